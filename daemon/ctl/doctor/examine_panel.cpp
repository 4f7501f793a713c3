#include <fmt/format.h>

#include <tuple>

#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/rig/open_devices.h"

namespace scanrig::ctl::doctor {
namespace {

using std::chrono::seconds;

constexpr seconds kPressLimit{15};
constexpr seconds kPanelLimit{1};
constexpr std::chrono::milliseconds kPanelGlance{100};
constexpr std::chrono::milliseconds kPowerGone{500};  ///< after the e-stop, until the drive must be off

/// Waits until the e-stop's input is `ok`; returns whether it came.
Result<bool> wait_for_estop(Panel& panel, bool ok, Clock& clock) {
  PanelInputs known;
  for (const auto by = Deadline::after(clock, kPressLimit); !by.expired(clock);) {
    const auto now = panel.wait_change(known, Deadline::after(clock, kPanelGlance));
    if (!now) return pass_on(now);
    if (now->estop_ok == ok) return true;
    known = *now;
  }
  return false;
}

/// Checks after the e-stop was pressed: does the drive still hold the motor?
bool drive_still_enabled(const config::RigConfig& rig, Clock& clock) {
  if (rig.turntable.driver == config::TurntableConfig::Driver::grbl)
    return false;  // it has no reading of the motor's power
  clock.sleep_for(kPowerGone);
  const auto& options = rig.turntable.modbus;
  ModbusDrive drive(options.line, options.profile, clock);
  const auto state = drive.read_state(Deadline::after(clock, kPanelLimit));
  return state && state->enabled && !state->fault;
}

std::string name_of(const config::Pin& pin) {
  if (!pin.chip.empty()) return fmt::format("line {}:{}", pin.chip, pin.offset);
  return pin.line.empty() ? fmt::format("channel {}", pin.channel) : fmt::format("line {}", pin.line);
}

void check_estop(const config::RigConfig& rig, Panel& panel, bool drive_answers, const Operator& person, Clock& clock,
                 Report& report) {
  const std::string line = name_of(rig.safety.estop);
  if (!person.there()) {
    return report.note("e-stop: its button was not tried, no operator to press it");
  }
  person.tell(fmt::format("Press the emergency stop within {} s and leave it pressed.", kPressLimit.count()));
  const auto pressed = wait_for_estop(panel, false, clock);
  if (!pressed) return report.find("panel", pressed.error().message + ".", "Check the panel's wiring.");
  if (!*pressed) {
    std::ignore = person.prompt(config::setup::Question{.text = "Release the emergency stop"});
    return report.find("estop_not_wired",
                       fmt::format("The emergency stop was to be pressed, and its input ({}) did not change.", line),
                       "Wire the second, normally closed contact of the emergency stop to this input; look for a "
                       "bridge left in place.");
  }
  report.note(fmt::format("e-stop: its input ({}) follows the button", line));
  if (drive_answers && drive_still_enabled(rig, clock)) {
    report.find("estop_keeps_power", "The emergency stop is pressed, and the drive still responds and is enabled.",
                "The emergency stop must take the motor's power away by a relay or the drive's STO input.");
  }
  person.tell("Release the emergency stop.");
  if (const auto released = wait_for_estop(panel, true, clock); released && !*released) {
    report.note("e-stop: it was not released");
  }
}

}  // namespace

bool examine_panel(const config::RigConfig& rig, bool drive_answers, const Operator& person, Clock& clock,
                   Report& report) {
  report.section("Panel");
  const auto open = open_devices(rig, clock);
  if (!open) {
    report.find("panel", open.error().message + ".", "Correct the configuration.");
    return false;
  }
  const auto now = open->panel->wait_change({}, Deadline::after(clock, kPanelLimit));
  if (!now) {
    const auto& line = rig.safety.estop.line;
    const bool estop = !line.empty() && now.error().message.find(line) != std::string::npos;
    report.find(estop ? "estop_not_wired" : "panel", now.error().message + ".",
                "Check the panel's wiring and power; name the lines as gpioinfo shows them.");
    return false;
  }
  report.note(fmt::format("e-stop {}, guard {}, start {}, stop {}, reset {}", now->estop_ok ? "ok" : "pressed",
                          now->guard_closed ? "closed" : "open", now->start ? "pressed" : "-",
                          now->stop ? "pressed" : "-", now->reset ? "pressed" : "-"));
  if (!now->estop_ok) {
    report.find("estop_not_wired", fmt::format("The emergency stop reads pressed ({}).", name_of(rig.safety.estop)),
                "Release it. If it is released: its normally closed contact is not wired to this input, or `active` is "
                "the wrong way round.");
    return false;
  }
  const auto found_before = report.findings().size();
  check_estop(rig, *open->panel, drive_answers, person, clock, report);
  return report.findings().size() == found_before;
}

}  // namespace scanrig::ctl::doctor
