#include "drivers/turntable/grbl_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanrig {
namespace {

using grbl::State;
using std::chrono::milliseconds;

constexpr int kAttempts = 3;
constexpr double kPulsesPerUnit = 1000;
constexpr double kExactIntegers = 1 << 23;  ///< up to here a 32-bit floating point number distinguishes 1 from 1.5
constexpr milliseconds kListen{20};
/// GRBL's settings [gnea/grbl wiki: Configuration].
constexpr int kReports = 10, kInches = 13, kHomingOn = 22, kSteps = 100, kAcceleration = 120;
constexpr double kAccelerationSlack = 1.001;  ///< settings are reported with three decimals

/// Bit 0 of a setting: where GRBL has 0 or 1, grblHAL has a mask.
bool is_on(double setting) { return std::isfinite(setting) && (std::lround(setting) & 1) != 0; }

}  // namespace

MovePlanner::Counter GrblDrive::counter(double pulses) {
  const double most = std::min<double>(std::numeric_limits<std::int32_t>::max(), pulses * kExactIntegers);
  return {-most, most};
}

int GrblDrive::index() const { return static_cast<int>(std::string_view("XYZABC").find(axis_)); }

Result<double> GrblDrive::position_in(const grbl::Report& report) const {
  if (index() < static_cast<int>(report.position.size())) {
    return std::round(report.position[static_cast<std::size_t>(index())] * kPulsesPerUnit);
  }
  return fail(ErrorCode::protocol, "the controller does not report the machine position of axis {}: set $10=1", axis_);
}

/// Requests a report and the probe in turn: the request after a missed reply is never the same one. So a reply that is
/// later than the quiet line, or repeated, is rejected.
Result<grbl::Report> GrblDrive::exchange(Deadline deadline) {
  bool report_first = true;
  for (int attempt = 1;; ++attempt) {
    Result<grbl::Report> report = fail(ErrorCode::internal, "not asked yet");
    Result<void> probed;
    // In a hold, asleep or after an alarm GRBL reads no lines, and nothing has arrived anyway.
    const auto probe = [&] {
      if (last_ == State::idle || last_ == State::run || last_ == State::jog) probed = link_.probe(deadline);
    };
    if (!report_first) probe();
    if (probed) report = link_.report(deadline);
    if (report) last_ = report->state;
    if (report_first && report) probe();
    if (report && probed) return report;
    const Error& error = probed ? report.error() : probed.error();
    if (attempt == kAttempts || !link_.reply_missed() || error.code == ErrorCode::io) return tl::unexpected(error);
    report_first = !probed;
    link_.count_retry();
  }
}

Result<DriveState> GrblDrive::read_state(Deadline deadline) {
  if (homing_) return watch_homing(deadline);
  const auto report = exchange(deadline);
  if (!report) return pass_on(report);
  const auto position = position_in(*report);
  if (!position) return pass_on(position);
  seen_ = *position;
  if (link_.restarted() || last_ == State::alarm || last_ == State::sleep) homed_ = false;
  DriveState state;
  state.fault = (last_ == State::alarm && alarm().wants_reset) || last_ == State::door || last_ == State::check ||
                last_ == State::sleep || last_ == State::tool;
  state.enabled = true;
  state.running = last_ == State::run || last_ == State::jog || last_ == State::home || report->underway;
  state.in_position = last_ == State::idle;
  state.homed = homed_;
  state.position = static_cast<std::int32_t>(std::clamp<double>(seen_ - zero_, std::numeric_limits<std::int32_t>::min(),
                                                                std::numeric_limits<std::int32_t>::max()));
  return state;
}

/// GRBL is silent until it has found home or given up.
Result<DriveState> GrblDrive::watch_homing(Deadline deadline) {
  const DriveState underway{
      .enabled = true, .running = true, .blind = true, .position = static_cast<std::int32_t>(seen_ - zero_)};
  const auto line = link_.listen(kListen);
  if (!line) return pass_on(line);
  if (!*line) return underway;
  using Kind = grbl::Line::Kind;
  const int number = (*line)->number;
  switch ((*line)->kind) {
    case Kind::ok: {
      homing_ = false;
      link_.forget_alarm();
      const auto report = exchange(deadline);
      if (!report) return pass_on(report);
      const auto position = position_in(*report);
      if (!position) return pass_on(position);
      zero_ = seen_ = *position;
      homed_ = true;
      return DriveState{.enabled = true, .running = true, .blind = true};
    }
    case Kind::error:
      homing_ = false;
      return fail(ErrorCode::protocol, "the controller refused to home: {}",
                  grbl::error_words(number, link_.firmware()));
    case Kind::alarm: {
      homing_ = false;
      const auto alarm = grbl::alarm_of(number, link_.firmware());
      return fail(alarm.switch_not_found ? ErrorCode::stalled : ErrorCode::device_alarm, "the controller reports {}",
                  alarm.words);
    }
    case Kind::banner:
      homing_ = false;
      return fail(ErrorCode::device_alarm, "the controller restarted while homing (power, reset button)");
    default: return underway;
  }
}

Result<std::string> GrblDrive::read_alarm(Deadline) {
  switch (last_) {
    case State::door: return "the safety door is open";
    case State::check: return "the controller only checks what it is told: leave the check mode ($C)";
    case State::sleep: return "the controller sleeps: reset it";
    case State::tool: return "the controller waits for a tool: reset it";
    case State::alarm: return alarm().wants_reset ? alarm().words : std::string();
    default: return std::string();
  }
}

grbl::Alarm GrblDrive::alarm() const { return grbl::alarm_of(link_.alarm(), link_.firmware()); }

/// Never sends "$X": that would allow moves although the position is lost.
Result<void> GrblDrive::reset_alarm(Deadline deadline) {
  homed_ = false;
  link_.forget_alarm();
  return link_.reset(deadline);
}

Result<void> GrblDrive::check(Deadline deadline) {
  // Locked, or waiting for a reset after an alarm that was raised before the connection: the reset ends the wait and
  // unlocks nothing.
  if (last_ == State::alarm || last_ == State::hold) {
    if (auto restarted = link_.reset(deadline); !restarted) return restarted;
  }
  const auto settings = link_.settings(deadline);
  if (!settings) return pass_on(settings);
  if (auto named = link_.identify(deadline); !named) return named;
  const bool has_file = link_.firmware() == grbl::Firmware::fluidnc;  // its settings are not set by number
  const auto value = [&](int number) {
    const auto found = settings->find(number);
    return found == settings->end() ? std::nan("") : found->second;
  };
  if (home_mode_ != "here" && !is_on(value(kHomingOn))) {
    const std::string remedy = has_file ? "give the axis a homing cycle in its file" : "set $22=1";
    return fail(ErrorCode::protocol, "the controller has homing switched off: {}, or home mode \"here\"", remedy);
  }
  if (!is_on(value(kReports)) || value(kInches) > 0) {
    return fail(ErrorCode::protocol, "the controller must report machine positions in mm: set $10=1 and $13=0");
  }
  const double most = acceleration_.value * scale_.gear_ratio;
  if (!(value(kAcceleration + index()) <= most * kAccelerationSlack)) {
    const std::string remedy = has_file ? fmt::format("acceleration_mm_per_sec2: {:.3f} in its file", most)
                                        : fmt::format("${}={:.3f}", kAcceleration + index(), most);
    return fail(ErrorCode::protocol,
                "the controller accelerates with {} deg/s2 at the table, configured are {}: set {}",
                value(kAcceleration + index()) / scale_.gear_ratio, acceleration_.value, remedy);
  }
  if (!(value(kSteps + index()) > 0)) {
    return fail(ErrorCode::protocol, "the controller has no axis {}: ${} is missing", axis_, kSteps + index());
  }
  return {};
}

/// After a completed hold a reset discards queued moves and keeps the position.
Result<void> GrblDrive::leave_hold(Deadline deadline) {
  if (last_ != State::hold) return {};
  if (auto restarted = link_.reset(deadline); !restarted) return restarted;
  last_ = State::idle;
  return {};
}

Result<void> GrblDrive::start_homing(Deadline deadline) {
  homed_ = false;
  auto begun = link_.begin("$H", deadline);
  homing_ = begun.has_value();
  return begun;
}

Result<void> GrblDrive::set_zero(Deadline deadline) {
  const auto report = exchange(deadline);
  if (!report) return pass_on(report);
  if (report->state != State::idle) {
    return fail(ErrorCode::protocol, "the controller is in state {}, not Idle: with home mode \"here\" set $22=0",
                grbl::name_of(report->state));
  }
  const auto position = position_in(*report);
  if (!position) return pass_on(position);
  zero_ = *position;
  homed_ = true;
  return {};
}

/// Every line states all modes: nothing depends on earlier lines.
Result<void> GrblDrive::start_move(std::int32_t target, Deadline deadline) {
  if (auto left = leave_hold(deadline); !left) return left;
  return link_.command(fmt::format("G21G90G94G53G1{}{:.3f}F{:.1f}", axis_, (zero_ + target) / kPulsesPerUnit,
                                   speed_.value * scale_.gear_ratio * 60.0),
                       deadline);
}

Result<void> GrblDrive::stop(Deadline deadline) {
  if (!homing_) {
    if (auto told = link_.at_once('!'); !told) return told;
    for (int attempt = 1;; ++attempt) {
      const auto report = link_.report(deadline);
      if (report) last_ = report->state;
      if (report && last_ != State::run && last_ != State::jog && last_ != State::home) return {};
      if (!report && report.error().code == ErrorCode::io) return pass_on(report);
      if (attempt == kAttempts) break;
    }
  }
  // GRBL homes, or does not read lines: the reset stops it in any state.
  auto restarted = link_.reset(deadline);
  if (!restarted) return restarted;
  homing_ = homed_ = false;
  last_ = State::alarm;
  return {};
}

void GrblDrive::stop_without_reply() {
  if (link_.reply_missed() && !homing_) std::ignore = link_.at_once('!');
}

}  // namespace scanrig
