#pragma once

#include <filesystem>

#include "config/rig_config.h"
#include "core/clock.h"
#include "daemon/ctl/doctor/doctor_report.h"

namespace scanrig::ctl::doctor {

/// The rig to be examined, and the file that a motion's guardian reads again.
struct Rig {
  const config::RigConfig& config;
  const std::filesystem::path& file;
};

/// Examines everything that the configuration names, in the order of daemon/ctl/doctor/README.md. Without `may_turn` a
/// person is prompted before the table turns. Fails with what made examine_motion() fail.
Result<void> examine_rig(const Rig& rig, bool may_turn, const Operator& person, Clock& clock, Report& report);

/// Checks whether the drive responds at its port as configured, how fast, and reads its registers. Otherwise finds what
/// responds there instead (`wrong_parity`, `wrong_baud`, `wrong_unit_id`, `swapped_adapter`, `no_answer`, ...).
/// Returns whether the drive can be used.
bool examine_drive(const config::RigConfig& rig, Clock& clock, Report& report);

/// Turns the table under the rules of with_motion(). Homes, then a quarter turn for the sign (the operator enters its
/// direction), then one revolution from home switch to home switch for the gear ratio. Findings: `cannot_turn`,
/// `reversed_sign`, `gear_ratio`. Fails with `stopped` (on request) and `refused` (e-stop, guard): examination ends.
Result<void> examine_motion(const Rig& rig, const Operator& person, Clock& clock, Report& report);

/// Checks that lamps can be lit and inputs read. With a person there, checks whether the e-stop's input follows the
/// button and whether the drive loses its power. Findings: `panel`, `estop_not_wired`, `estop_keeps_power`.
/// Returns whether the table may be turned: no finding against the emergency stop.
bool examine_panel(const config::RigConfig& rig, bool drive_answers, const Operator& person, Clock& clock,
                   Report& report);

/// Lists serial adapters, GPIO chips with their named lines, USB devices and the groups of the user.
void list_what_is_connected(Report& report);

/// Checks whether this user may open `device` for reading and writing. If not, a finding gives the reason: no such
/// device, or the missing group (`device_missing`, `missing_group`).
bool may_open(const std::filesystem::path& device, const std::string& section, Report& report);

/// The udev rule that gives the adapter behind `device` the name the configuration uses, and the systemd unit, where
/// this machine has none yet.
void print_missing_snippets(const std::filesystem::path& device, const std::filesystem::path& config, Report& report);

}  // namespace scanrig::ctl::doctor
