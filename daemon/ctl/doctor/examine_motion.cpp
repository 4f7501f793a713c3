#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>

#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/ctl/motion_session.h"

namespace scanrig::ctl::doctor {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds kMoveLimit{60};
constexpr std::chrono::seconds kRevolutionLimit{180};
constexpr double kAsideDeg = 20.0;  ///< away from the switch before it is sought again
constexpr double kRatioTolerance = 0.005;
constexpr double kHomingShare = 0.5;  ///< of the working speed
constexpr milliseconds kPoll{2};

/// Drives the motor past the home switch twice; the drive's own counter says how far that is.
class Revolution {
 public:
  /// `is_stop_requested` ends it with `stopped`; the caller stops the drive after any failure.
  Revolution(const ModbusTurntableOptions& options, Clock& clock, ModbusDrive& drive,
             const std::atomic<bool>& is_stop_requested)
      : options_(options), clock_(clock), drive_(drive), is_stop_requested_(is_stop_requested) {}

  /// Pulses from the home switch to the home switch, once around. The table is at home before.
  Result<double> pulses() {
    for (const int side : {-1, +1}) {
      const auto gone = step_aside(side);
      if (!gone) return pass_on(gone);
      const auto back = seek_switch();
      if (!back) return pass_on(back);
      // Coming straight back is not going around: then the switch is sought from the other side.
      if (*back > 2.0 * std::abs(*gone)) return *back + std::abs(*gone);
    }
    return fail(ErrorCode::stalled, "homing came straight back to the switch from both sides");
  }

 private:
  Result<DriveMotion> motion(double share) const {
    const auto& o = options_;
    const auto speed = o.scale.speed_word({o.speed.value * share}, o.profile);
    const auto acceleration = o.scale.acceleration_word(o.acceleration, o.profile);
    if (!speed) return pass_on(speed);
    if (!acceleration) return pass_on(acceleration);
    return DriveMotion{*speed, *acceleration, *acceleration, *speed};
  }

  Result<double> step_aside(int side) {
    const auto by = Deadline::after(clock_, kMoveLimit);
    const auto before = read_state(by);
    const auto words = motion(1.0);
    if (!before) return pass_on(before);
    if (!words) return pass_on(words);
    const auto way = static_cast<std::int32_t>(side * kAsideDeg * options_.scale.pulses_per_degree());
    if (auto sent = drive_.start_move(before->position + way, *words, by); !sent) return pass_on(sent);
    for (bool arrived = false; !arrived; clock_.sleep_for(kPoll)) {
      const auto state = read_state(by);
      if (!state) return pass_on(state);
      arrived = !state->running && std::abs(state->position - before->position - way) < std::abs(way) / 50;
      if (by.expired(clock_)) return fail(ErrorCode::timeout, "the table did not step aside");
    }
    return way;
  }

  /// Distance to the switch, pulses.
  Result<double> seek_switch() {
    const auto by = Deadline::after(clock_, kRevolutionLimit);
    const auto before = read_state(by);
    const auto fast = motion(kHomingShare);
    if (!before) return pass_on(before);
    if (!fast) return pass_on(fast);
    if (auto set = drive_.set_homing(options_.home_mode, *fast, by); !set) return pass_on(set);
    if (auto started = drive_.start_homing(by); !started) return pass_on(started);
    // The furthest reading, not the last: state and position are read in turn, and home sets the position to zero.
    double furthest = 0.0;
    for (bool begun = false;; clock_.sleep_for(kPoll)) {
      const auto state = read_state(by);
      if (!state) return pass_on(state);
      begun = begun || state->running || !state->homed;
      if (begun && state->homed && !state->running) return furthest;
      if (state->running)
        furthest = std::max(furthest, std::abs(static_cast<double>(state->position) - before->position));
      if (state->fault) return fail(ErrorCode::device_alarm, "the drive raised an alarm while it sought the switch");
      if (by.expired(clock_)) return fail(ErrorCode::timeout, "the home switch was not seen again");
    }
  }

  /// The drive's state, unless a stop was requested.
  Result<DriveState> read_state(Deadline by) {
    if (is_stop_requested_) return fail(ErrorCode::stopped, "stopped on request");
    return drive_.read_state(by);
  }

  const ModbusTurntableOptions& options_;
  Clock& clock_;
  ModbusDrive& drive_;
  const std::atomic<bool>& is_stop_requested_;
};

Result<void> home_and_turn(Turntable& table, std::initializer_list<double> degrees, Clock& clock) {
  if (auto homed = table.home(Deadline::after(clock, kMoveLimit)); !homed) return homed;
  for (const double deg : degrees) {
    if (const auto moved = table.rotate_to({deg}, Deadline::after(clock, kMoveLimit)); !moved) return pass_on(moved);
  }
  return {};
}

void check_sign(const config::RigConfig& rig, const Operator& person, Report& report) {
  const auto said = person.prompt(
      "The table was told to go home and then a quarter turn counter-clockwise. Seen from "
      "above, which way did the quarter turn go? [ccw/cw]");
  if (!said || (*said != "ccw" && *said != "cw")) {
    return report.note("sign: not checked, no direction was entered");
  }
  const char* configured = rig.turntable.motion().scale.positive_ccw ? "ccw" : "cw";
  report.note(fmt::format("sign: told counter-clockwise, seen {}", *said));
  if (*said == "ccw") return;
  report.find(
      "reversed_sign",
      fmt::format("The table turns clockwise where counter-clockwise is meant (positive = \"{}\").", configured),
      fmt::format("Set positive = \"{}\" in [turntable].", rig.turntable.motion().scale.positive_ccw ? "cw" : "ccw"));
}

void compare_gear(double configured, double ratio, Report& report) {
  if (std::abs(ratio / configured - 1.0) <= kRatioTolerance) return;
  report.find(
      "gear_ratio",
      fmt::format("One turn of the table takes {:.2f} motor turns, the configuration says {:.2f}.", ratio, configured),
      fmt::format("Set gear_ratio = {:.2f} (or the gear's exact ratio near it) in [turntable].", ratio));
}

/// Measures by the drive's own counter, from the home switch to the home switch.
Result<void> check_gear_by_switch(const Rig& rig, Clock& clock, Report& report) {
  const auto& options = rig.config.turntable.modbus;
  double pulses = 0.0;
  const auto moved = with_motion(rig.config, rig.file, clock, [&](Motion& motion) -> Result<void> {
    auto homed = motion.turn([&](Turntable& table) { return home_and_turn(table, {}, clock); });
    if (!homed) return homed;
    return motion.turn_drive([&](ModbusDrive& drive, const std::atomic<bool>& is_stop_requested) -> Result<void> {
      const auto counted = Revolution(options, clock, drive, is_stop_requested).pulses();
      if (!counted) return pass_on(counted);
      pulses = *counted;
      return {};
    });
  });
  if (!moved) return moved;
  const double ratio = pulses / options.scale.pulses_per_motor_rev;
  report.note(fmt::format("gear: one turn of the table, switch to switch, is {:.0f} pulses, {:.3f} motor turns", pulses,
                          ratio));
  compare_gear(options.scale.gear_ratio, ratio, report);
  return {};
}

/// Measures by a mark that the operator puts on the table: for drives that cannot count from a switch. Nothing may move
/// meanwhile, so there are two motions; home is the same place in both.
Result<void> check_gear_by_mark(const Rig& rig, const Operator& person, Clock& clock, Report& report) {
  if (!person.there()) {
    report.note("gear: not checked, no operator to watch a mark on the table");
    return {};
  }
  const auto turn_to = [&](std::initializer_list<double> degrees) {
    return with_motion(rig.config, rig.file, clock, [&](Motion& motion) {
      return motion.turn([&](Turntable& table) { return home_and_turn(table, degrees, clock); });
    });
  };
  if (auto moved = turn_to({0}); !moved) return moved;
  std::ignore = person.prompt("Put a mark on the table and one on the base beside it, keep clear, then press Enter.");
  if (auto moved = turn_to({120, 240, 0}); !moved) return moved;
  const auto said = person.prompt(
      "The table was told to make one whole turn. By how many degrees is its mark away from the other one? [0; -10: "
      "it stopped 10 degrees short; 10: it went 10 degrees too far]");
  double off_deg = 0.0;
  if (!said || std::sscanf(said->c_str(), "%lf", &off_deg) != 1 || std::abs(off_deg) >= 360.0) {
    report.note("gear: not checked, no angle of the mark was entered");
    return {};
  }
  const double configured = rig.config.turntable.motion().scale.gear_ratio;
  report.note(fmt::format("gear: told to turn 360 degrees, the table was seen to turn {:.1f}", 360.0 + off_deg));
  compare_gear(configured, configured * 360.0 / (360.0 + off_deg), report);
  return {};
}

}  // namespace

Result<void> examine_motion(const Rig& rig, const Operator& person, Clock& clock, Report& report) {
  const auto failed = [&](Error error) -> Result<void> {
    if (error.code == ErrorCode::stopped || error.code == ErrorCode::refused) return tl::unexpected(std::move(error));
    report.find("cannot_turn", error.message + ".", "Remove the cause and run the doctor again.");
    return {};
  };
  report.section("Turntable: motion");
  const auto shown = with_motion(rig.config, rig.file, clock, [&](Motion& motion) {
    return motion.turn([&](Turntable& table) { return home_and_turn(table, {90}, clock); });
  });
  if (!shown) return failed(shown.error());
  check_sign(rig.config, person, report);
  const auto& turntable = rig.config.turntable;
  const bool counts_from_switch = turntable.driver == config::TurntableConfig::Driver::modbus &&
                                  turntable.modbus.home_mode != "here" && !turntable.modbus.profile.homing.absolute;
  const auto checked =
      counts_from_switch ? check_gear_by_switch(rig, clock, report) : check_gear_by_mark(rig, person, clock, report);
  return checked ? checked : failed(checked.error());
}

}  // namespace scanrig::ctl::doctor
