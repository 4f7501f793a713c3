#pragma once

#include <filesystem>

#include "config/rig_config.h"
#include "core/clock.h"
#include "daemon/ctl/doctor/findings.h"
#include "daemon/ctl/doctor/operator.h"

namespace scanrig::ctl::doctor {

/// Whether the drive answers at its port as configured, how fast, and what its registers say. Where it does not: who
/// answers there instead (`wrong_parity`, `wrong_baud`, `wrong_unit_id`, `swapped_adapter`, `no_answer`, ...).
/// Returns whether the drive can be worked with.
bool examine_drive(const config::RigConfig& rig, Clock& clock, Report& report);

/// The rig to be examined, and the file that a motion's guardian reads again.
struct Rig {
  const config::RigConfig& config;
  const std::filesystem::path& file;
};

/// Turns the table under the rules of with_motion(): home, a quarter turn for the sign (the operator says which way it
/// went), one revolution from home switch to home switch for the gear ratio. Findings: `cannot_turn`, `reversed_sign`,
/// `gear_ratio`. Fails with `stopped` (somebody stopped it) and `refused` (e-stop, guard): the examination ends.
Result<void> examine_motion(const Rig& rig, const Operator& person, Clock& clock, Report& report);

/// Lamps can be lit, inputs read; with somebody there, whether the e-stop's input follows the button and whether the
/// drive loses its power. Findings: `panel`, `estop_not_wired`, `estop_keeps_power`.
/// Returns whether the table may be turned: nothing speaks against the emergency stop.
bool examine_panel(const config::RigConfig& rig, bool drive_answers, const Operator& person, Clock& clock,
                   Report& report);

}  // namespace scanrig::ctl::doctor
