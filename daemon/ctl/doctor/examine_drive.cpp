#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "daemon/ctl/doctor/examine_rig.h"
#include "drivers/discovery/serial_devices.h"

namespace scanrig::ctl::doctor {
namespace {

using std::chrono::milliseconds;

constexpr int kReads = 50;
constexpr std::chrono::seconds kAskLimit{2};

/// No device understood the configured settings: find out which device is there.
void find_out_who_is_there(const ModbusTurntableOptions& options, Clock& clock, Report& report) {
  const auto& line = options.line;
  if (const auto grbl = discovery::grbl_answer(line.device, clock)) {
    return report.find(
        "swapped_adapter",
        fmt::format("At {} a GRBL controller responds ({}), not a {} drive.", line.device, *grbl, options.profile.name),
        "Is the right adapter named in [turntable]? If this is the turntable, set driver = \"grbl\".");
  }
  const auto found =
      discovery::find_modbus(line, {.address = options.profile.status.address}, options.profile.max_unit_id, clock);
  if (!found) {
    return report.find("no_answer",
                       fmt::format("Nothing responds at {}: no Modbus device with any parity, speed or unit id, and no "
                                   "GRBL controller.",
                                   line.device),
                       "Check the drive's power, A and B of the RS-485 line, its termination, and that this is the "
                       "right adapter.");
  }
  if (!found->has_trait) {
    return report.find(
        "swapped_adapter",
        fmt::format("At {} unit {} responds, but it has no register 0x{:04X}: it is not a {} drive.", line.device,
                    found->line.unit_id, options.profile.status.address, options.profile.name),
        "The adapters are swapped, or the profile is wrong: name the drive's adapter in [turntable].");
  }
  if (found->line.unit_id != line.unit_id) {
    return report.find("wrong_unit_id",
                       fmt::format("The drive at {} has unit id {}, the configuration says {}.", line.device,
                                   found->line.unit_id, line.unit_id),
                       fmt::format("Set unit_id = {} in [turntable].", found->line.unit_id));
  }
  if (found->line.baud != line.baud) {
    return report.find("wrong_baud",
                       fmt::format("The drive at {} responds at {} baud with parity {}, the configuration says {}.",
                                   line.device, found->line.baud, discovery::word(found->line.parity), line.baud),
                       fmt::format("Set baud = {} and parity = \"{}\" in [turntable].", found->line.baud,
                                   discovery::word(found->line.parity)));
  }
  if (found->line.parity != line.parity) {
    return report.find("wrong_parity",
                       fmt::format("The drive at {} responds with parity {}, the configuration says {}.", line.device,
                                   discovery::word(found->line.parity), discovery::word(line.parity)),
                       fmt::format("Set parity = \"{}\" in [turntable].", discovery::word(found->line.parity)));
  }
  report.find("unreliable_line",
              fmt::format("The drive at {} responds to some requests only as configured.", line.device),
              "Check termination, shielding and the length of the RS-485 line.");
}

bool measure_replies(ModbusDrive& drive, Clock& clock, Report& report) {
  std::vector<double> ms;
  int missed = 0;
  for (int i = 0; i < kReads; ++i) {
    const auto asked = clock.now();
    const auto state = drive.read_state(Deadline::after(clock, kAskLimit));
    if (!state) ++missed;
    ms.push_back(std::chrono::duration<double, std::milli>(clock.now() - asked).count());
  }
  std::ranges::sort(ms);
  report.note(
      fmt::format("{} readings of state and position: median {:.1f} ms, longest {:.1f} ms, {} missed, {} "
                  "repeated",
                  kReads, ms[ms.size() / 2], ms.back(), missed, drive.statistics().retries));
  if (missed == 0 && drive.statistics().retries * 20 <= kReads) return true;
  report.find("unreliable_line",
              fmt::format("{} of {} readings failed and {} were repeated.", missed, kReads, drive.statistics().retries),
              "Check termination, shielding and reply_timeout_ms.");
  return missed < kReads;
}

void tell_registers(ModbusDrive& drive, const ModbusTurntableOptions& options, Clock& clock, Report& report) {
  const auto state = drive.read_state(Deadline::after(clock, kAskLimit));
  const auto alarm = drive.read_alarm(Deadline::after(clock, kAskLimit));
  const auto pulses = drive.read_pulses_per_motor_rev(Deadline::after(clock, kAskLimit));
  if (state) {
    report.note(fmt::format("position {} pulses, {}, {}, {}", state->position, state->enabled ? "enabled" : "off",
                            state->running ? "running" : "stopped", state->homed ? "homed" : "no home"));
  }
  if (alarm && !alarm->empty()) {
    report.find("drive_alarm", fmt::format("The drive reports an alarm: {}.", *alarm),
                "Remove its cause; Reset at the panel clears it, or switch the drive off and on.");
  }
  if (pulses && *pulses != options.scale.pulses_per_motor_rev) {
    report.find("pulses_per_motor_rev",
                fmt::format("The drive is set to {} pulses a motor turn, the configuration says {}.", *pulses,
                            options.scale.pulses_per_motor_rev),
                fmt::format("Set pulses_per_motor_rev = {} in [turntable].", *pulses));
  }
}

bool examine_grbl(const config::RigConfig& rig, Clock& clock, Report& report) {
  const std::string& device = rig.turntable.device();
  report.section(fmt::format("Turntable: GRBL at {}", device));
  if (!may_open(device, "turntable", report)) return false;
  const auto table = GrblTurntable::create(rig.turntable.grbl, clock);
  const auto status = table ? (*table)->status(Deadline::after(clock, kAskLimit)) : pass_on(table);
  if (!status) {
    report.find("silent", status.error().message + ".", "Check power, wiring and baud of the controller.");
    return false;
  }
  report.note("it responds as GRBL 1.1 does");
  if (!status->alarm.empty()) {
    report.find("drive_alarm", fmt::format("The controller reports an alarm: {}.", status->alarm),
                "Remove its cause; Reset at the panel clears it.");
  }
  return true;
}

}  // namespace

bool examine_drive(const config::RigConfig& rig, Clock& clock, Report& report) {
  if (rig.turntable.driver == config::TurntableConfig::Driver::grbl) return examine_grbl(rig, clock, report);
  const auto& options = rig.turntable.modbus;
  report.section(fmt::format("Turntable: {} at {}", options.profile.name, options.line.device));
  if (!may_open(options.line.device, "turntable", report)) return false;
  std::optional<ModbusDrive> drive(std::in_place, options.line, options.profile, clock);
  const auto first = drive->read_state(Deadline::after(clock, kAskLimit));
  if (first) {
    const bool reliable = measure_replies(*drive, clock, report);
    tell_registers(*drive, options, clock, report);
    return reliable;
  }
  drive.reset();  // the port is free for other requests
  report.note(first.error().message);
  if (first.error().code == ErrorCode::io) {
    report.find("port", fmt::format("The port cannot be used: {}.", first.error().message),
                "Stop the program that has it, or plug the adapter in again.");
    return false;
  }
  find_out_who_is_there(options, clock, report);
  return false;
}

}  // namespace scanrig::ctl::doctor
