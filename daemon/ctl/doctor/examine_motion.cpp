#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "daemon/ctl/doctor/examine.h"
#include "daemon/rig/open_devices.h"

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
  Revolution(const ModbusTurntableOptions& options, Clock& clock)
      : options_(options), clock_(clock), drive_(options.line, options.profile, clock) {}

  /// Pulses from the home switch to the home switch, once around. The table stands at home before.
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
    const auto before = drive_.read_state(by);
    const auto words = motion(1.0);
    if (!before) return pass_on(before);
    if (!words) return pass_on(words);
    const auto way = static_cast<std::int32_t>(side * kAsideDeg * options_.scale.pulses_per_degree());
    if (auto sent = drive_.start_move(before->position + way, *words, by); !sent) return pass_on(sent);
    for (bool arrived = false; !arrived; clock_.sleep_for(kPoll)) {
      const auto state = drive_.read_state(by);
      if (!state) return pass_on(state);
      arrived = !state->running && std::abs(state->position - before->position - way) < std::abs(way) / 50;
      if (by.expired(clock_)) return fail(ErrorCode::timeout, "the table did not step aside");
    }
    return way;
  }

  /// How far it was to the switch, pulses.
  Result<double> seek_switch() {
    const auto by = Deadline::after(clock_, kRevolutionLimit);
    const auto before = drive_.read_state(by);
    const auto fast = motion(kHomingShare);
    if (!before) return pass_on(before);
    if (!fast) return pass_on(fast);
    if (auto set = drive_.set_homing(options_.home_mode, *fast, by); !set) return pass_on(set);
    if (auto started = drive_.start_homing(by); !started) return pass_on(started);
    // The furthest way seen, not the last: state and position are read in turn, and home sets the position to zero.
    double furthest = 0.0;
    for (bool begun = false;; clock_.sleep_for(kPoll)) {
      const auto state = drive_.read_state(by);
      if (!state) return pass_on(state);
      begun = begun || state->running || !state->homed;
      if (begun && state->homed && !state->running) return furthest;
      if (state->running)
        furthest = std::max(furthest, std::abs(static_cast<double>(state->position) - before->position));
      if (state->fault) return fail(ErrorCode::device_alarm, "the drive raised an alarm while it sought the switch");
      if (by.expired(clock_)) return fail(ErrorCode::timeout, "the home switch was not seen again");
    }
  }

  ModbusTurntableOptions options_;
  Clock& clock_;
  ModbusDrive drive_;
};

/// Home, then a quarter turn that ought to be counter-clockwise.
Result<void> show_quarter_turn(const config::RigConfig& rig, Clock& clock) {
  const auto open = open_devices(rig, clock);
  if (!open) return pass_on(open);
  auto& table = *open->turntable;
  if (auto homed = table.home(Deadline::after(clock, kMoveLimit)); !homed) return homed;
  const auto moved = table.rotate_to({90}, Deadline::after(clock, kMoveLimit));
  if (!moved) return pass_on(moved);
  return {};
}

Result<void> go_home(const config::RigConfig& rig, Clock& clock) {
  const auto open = open_devices(rig, clock);
  if (!open) return pass_on(open);
  auto& table = *open->turntable;
  return table.home(Deadline::after(clock, kMoveLimit));
}

void check_sign(const config::RigConfig& rig, const Operator& person, Report& report) {
  const auto said = person.ask(
      "The table was told to go home and then a quarter turn counter-clockwise. Seen from "
      "above, which way did the quarter turn go? [ccw/cw]");
  if (!said || (*said != "ccw" && *said != "cw")) {
    return report.note("sign: not checked, nobody has said which way the table turned");
  }
  const char* configured = rig.turntable.motion().scale.positive_ccw ? "ccw" : "cw";
  report.note(fmt::format("sign: told counter-clockwise, seen {}", *said));
  if (*said == "ccw") return;
  report.find(
      "reversed_sign",
      fmt::format("The table turns clockwise where counter-clockwise is meant (positive = \"{}\").", configured),
      fmt::format("Set positive = \"{}\" in [turntable].", rig.turntable.motion().scale.positive_ccw ? "cw" : "ccw"));
}

void check_gear(const ModbusTurntableOptions& options, double pulses, Report& report) {
  const double ratio = pulses / options.scale.pulses_per_motor_rev;
  report.note(fmt::format("gear: one turn of the table, switch to switch, is {:.0f} pulses, {:.3f} motor turns", pulses,
                          ratio));
  if (std::abs(ratio / options.scale.gear_ratio - 1.0) <= kRatioTolerance) return;
  report.find("gear_ratio",
              fmt::format("One turn of the table takes {:.2f} motor turns, the configuration says {:.2f}.", ratio,
                          options.scale.gear_ratio),
              fmt::format("Set gear_ratio = {:.2f} (or the gear's exact ratio near it) in [turntable].", ratio));
}

}  // namespace

void examine_motion(const config::RigConfig& rig, const Operator& person, Clock& clock, Report& report) {
  const auto failed = [&](const Error& error) {
    report.find("cannot_turn", error.message + ".", "Remove the cause and run the doctor again.");
  };
  report.section("Turntable: motion");
  if (auto shown = show_quarter_turn(rig, clock); !shown) return failed(shown.error());
  check_sign(rig, person, report);
  const auto& options = rig.turntable.modbus;
  if (rig.turntable.driver == config::TurntableConfig::Driver::grbl) {
    return report.note("gear: not measured, GRBL counts its own steps only: look whether a quarter turn is one");
  }
  if (options.home_mode == "here" || options.profile.homing.absolute) {
    return report.note("gear: not measured, this rig has no home switch to count from");
  }
  if (auto homed = go_home(rig, clock); !homed) return failed(homed.error());
  const auto pulses = Revolution(options, clock).pulses();
  if (!pulses) return failed(pulses.error());
  check_gear(options, *pulses, report);
}

}  // namespace scanrig::ctl::doctor
