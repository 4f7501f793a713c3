#include <cmath>
#include <map>
#include <thread>

#include "tests/bench/fault_matrix/turntable_end.h"

namespace scanrig::bench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kMotionLimit{4};  ///< for a call that moves: longer than the 2 s after which a stall is detected
constexpr milliseconds kAskLimit{1500};
constexpr seconds kAmple{15};
constexpr milliseconds kAbsence{2000};
constexpr double kFarDeg = 170;
/// Deceleration from full speed, as commanded to the drive; and the extra margin of the table.
constexpr milliseconds kDeceleration{static_cast<int>(1000 * kSpeedDegS / kAccelerationDegS2)};
constexpr milliseconds kRestGrace{100};

/// True if the table starts to turn, and then no longer accelerates.
bool at_full_speed(TurntableEnd& end, Clock& clock, Clock::Duration limit, const std::stop_token& stop = {}) {
  constexpr milliseconds kApart{20};
  double before = 0;
  auto next = clock.now();
  return soon(clock, limit, [&] {
    if (stop.stop_requested()) return true;
    if (clock.now() < next) return false;
    next = clock.now() + kApart;
    const double speed = std::abs(end.truth().speed_deg_s);
    return speed > 0 && speed <= std::exchange(before, speed);
  });
}

/// Runs an action once the table turns at full speed, from another thread.
class Onlooker {
 public:
  Onlooker(TurntableEnd& end, Clock& clock, std::function<void()> act)
      : thread_([&end, &clock, act = std::move(act)](const std::stop_token& stop) {
          if (at_full_speed(end, clock, kMotionLimit, stop) && !stop.stop_requested()) act();
        }) {}

 private:
  std::jthread thread_;
};

struct Method {
  bool moves = false;
  std::function<Result<void>(Turntable&, Deadline)> call;
};

const std::map<std::string, Method>& methods() {
  static const std::map<std::string, Method> all{
      {"home", {true, [](Turntable& table, Deadline by) { return table.home(by); }}},
      {"rotate_to",
       {true,
        [](Turntable& table, Deadline by) -> Result<void> {
          const auto moved = table.rotate_to({kFarDeg}, by);
          if (!moved) return pass_on(moved);
          return {};
        }}},
      {"stop", {false, [](Turntable& table, Deadline by) { return table.stop(by); }}},
      {"reset_alarm", {false, [](Turntable& table, Deadline by) { return table.reset_alarm(by); }}},
      {"status",
       {false,
        [](Turntable& table, Deadline by) -> Result<void> {
          const auto status = table.status(by);
          if (!status) return pass_on(status);
          return {};
        }}},
      // Its effect shows in the call that it ends.
      {"request_stop", {true, [](Turntable& table, Deadline by) -> Result<void> {
                          const auto moved = table.rotate_to({kFarDeg}, by);
                          if (!moved) return pass_on(moved);
                          return {};
                        }}}};
  return all;
}

std::optional<std::string> why_not(const TurntableKind& kind, const std::string& method, Fault fault) {
  const bool grbl = kind.driver == "GrblTurntable";
  if (grbl && method == "stop" && fault == Fault::earlier_answer) {
    return "in a hold GRBL answers nothing but '?': a report one question old is still true of a table that slows down";
  }
  if (fault != Fault::stalled) return std::nullopt;
  if (grbl && method != "home") {
    return "GRBL counts its steps and measures nothing: a blocked table is found by the next homing, and by the views";
  }
  if (method == "stop") return "a blocked table stands: stop succeeds as it should";
  if (method == "status" || method == "reset_alarm") return "moves nothing, so nothing can stall";
  return std::nullopt;
}

std::vector<ErrorCode> named(const std::string& method, Fault fault) {
  std::vector<ErrorCode> codes;
  switch (fault) {
    case Fault::silent:
    case Fault::late: codes = {ErrorCode::timeout}; break;
    case Fault::damaged: codes = {ErrorCode::protocol, ErrorCode::timeout}; break;
    case Fault::earlier_answer: codes = {ErrorCode::protocol}; break;
    case Fault::stalled: codes = {ErrorCode::stalled}; break;
    case Fault::unplugged:
    case Fault::back_after_2s: codes = {ErrorCode::io}; break;
    case Fault::device_error: codes = {ErrorCode::device_alarm}; break;
  }
  if (fault == Fault::device_error && (method == "stop" || method == "status")) codes = {};  // reports, does not fail
  if (method == "request_stop") codes.push_back(ErrorCode::stopped);
  return codes;
}

/// Unrequested output of GRBL, such as an alarm, is no wrong reply when repeated: the right reply is missing.
std::vector<ErrorCode> named(const TurntableKind& kind, const std::string& method, Fault fault) {
  auto codes = named(method, fault);
  if (kind.driver == "GrblTurntable" && fault == Fault::earlier_answer) codes.push_back(ErrorCode::timeout);
  return codes;
}

/// True if the drive receives a stop while the fault lasts.
bool reachable(Fault fault) {
  return fault != Fault::silent && fault != Fault::unplugged && fault != Fault::back_after_2s;
}

class Trial {
 public:
  Trial(const TurntableKind& kind, std::string method, Fault fault)
      : end_(kind.make(clock_)), named_(named(kind, method, fault)), method_(std::move(method)), fault_(fault) {}

  Outcome run() {
    if (auto ready = start_at_zero(); !ready) return broken(ready.error());
    Outcome outcome = disturbed_call();
    expect_rest(outcome);
    recover(outcome);
    return outcome;
  }

 private:
  Deadline within(Clock::Duration time) { return Deadline::after(clock_, time); }

  static Outcome broken(const Error& error) {
    Outcome outcome{.told = error.message};
    outcome.expect(false, "the trial could not begin");
    return outcome;
  }

  Result<void> start_at_zero() {
    if (auto homed = end_->table().home(within(kAmple)); !homed) return homed;
    const auto moved = end_->table().rotate_to({0}, within(kAmple));
    if (!moved) return pass_on(moved);
    zero_deg_ = end_->truth().table_deg;
    if (method_ != "home") return {};
    const auto away = end_->table().rotate_to({120}, within(kAmple));  // homing is a way
    if (!away) return pass_on(away);
    return {};
  }

  Outcome disturbed_call() {
    const Method& method = methods().at(method_);
    const auto begin = [&] {
      end_->begin(fault_);
      begun_ = clock_.now();
      if (method_ == "request_stop") end_->table().request_stop();
    };
    std::unique_ptr<Onlooker> onlooker;
    if (method.moves && fault_ == Fault::stalled) {
      begin();  // from the start: no turning will be seen
    } else if (method.moves) {
      onlooker = std::make_unique<Onlooker>(*end_, clock_, begin);
    } else {
      if (method_ == "reset_alarm") {
        end_->raise_alarm(fault_ != Fault::device_error);
      } else {
        end_->send_round();
        at_full_speed(*end_, clock_, kMotionLimit);
      }
      begin();
    }
    return timed(clock_, method.moves ? Clock::Duration(kMotionLimit) : Clock::Duration(kAskLimit), named_,
                 [&](Deadline by) { return method.call(end_->table(), by); });
  }

  bool comes_to_rest() {
    return soon(clock_, kDeceleration + kRestGrace, [&] { return !end_->truth().moving; });
  }

  /// Checks that the table is stopped, or that the driver reports that it may be moving.
  void expect_rest(Outcome& outcome) {
    const bool meant_to_stop = method_ != "status" && method_ != "reset_alarm";
    if (!meant_to_stop) return;
    if (!reachable(fault_)) {
      const bool owned_up = outcome.told.find("may be moving") != std::string::npos;
      return outcome.expect(owned_up, "does not say that the table may be moving");
    }
    outcome.expect(comes_to_rest(), "the table still turns");
  }

  /// After the fault: reset, home, a move that ends at its reported angle.
  void recover(Outcome& outcome) {
    if (fault_ == Fault::back_after_2s) clock_.sleep_until(begun_ + kAbsence);
    end_->end(fault_);
    auto& table = end_->table();
    if (method_ == "reset_alarm" && fault_ == Fault::device_error) end_->power_cycle();
    const auto fail_with = [&](const char* what, const Error& error) {
      outcome.expect(false, fmt::format("{} afterwards: {}", what, error.message));
    };
    if (auto stopped = table.stop(within(kAmple)); !stopped) return fail_with("stop", stopped.error());
    if (auto reset = table.reset_alarm(within(kAmple)); !reset) return fail_with("reset", reset.error());
    auto homed = table.home(within(kAmple));
    // A stop requested after the failed call applies to the next one.
    if (!homed && homed.error().code == ErrorCode::stopped) homed = table.home(within(kAmple));
    if (!homed) return fail_with("home", homed.error());
    const auto moved = table.rotate_to({45}, within(kAmple));
    if (!moved) return fail_with("the next move", moved.error());
    outcome.expect(comes_to_rest(), "the next move ends turning");
    const double off = std::remainder(end_->truth().table_deg - zero_deg_ - 45, 360.0);
    outcome.wrong_position = std::abs(off) > 2 * kToleranceDeg;
    outcome.expect(!outcome.wrong_position, fmt::format("the next move ended {:.3f} deg off", off));
  }

  RealClock clock_;
  std::unique_ptr<TurntableEnd> end_;
  const std::vector<ErrorCode> named_;
  const std::string method_;
  const Fault fault_;
  double zero_deg_ = 0;
  Clock::TimePoint begun_;
};

}  // namespace

std::vector<Cell> turntable_cells(const std::filesystem::path& scratch, const std::filesystem::path& profiles) {
  std::vector<Cell> cells;
  for (const TurntableKind& kind : shipped_turntables(scratch, profiles)) {
    for (const auto& [method, unused] : methods()) {
      for (const auto& [fault, name] : kFaults) {
        cells.push_back({kind.driver, kind.device, method, fault, [kind, method = method, fault = fault] {
                           if (auto reason = why_not(kind, method, fault)) return not_applicable(*reason);
                           return Trial(kind, method, fault).run();
                         }});
      }
    }
    for (const auto& [fault, name] : kFaults) {
      cells.push_back(
          {kind.driver, kind.device, "drop_stop_request", fault, [] { return not_applicable("sends nothing"); }});
    }
  }
  return cells;
}

}  // namespace scanrig::bench
