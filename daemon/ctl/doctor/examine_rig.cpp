#include "daemon/ctl/doctor/examine_rig.h"

namespace scanrig::ctl::doctor {

Result<void> examine_rig(const Rig& rig, bool may_turn, const Operator& person, Clock& clock, Report& report) {
  list_what_is_connected(report);
  const bool drive_answers = examine_drive(rig.config, clock, report);
  const bool estop_works = examine_panel(rig.config, drive_answers, person, clock, report);
  const auto permitted = [&] { return may_turn || person.prompt("Is everyone clear? Turn the table? [y/N]") == "y"; };
  Result<void> moved;
  if (drive_answers && estop_works && permitted()) moved = examine_motion(rig, person, clock, report);
  print_missing_snippets(rig.config.turntable.device(), rig.file, report);
  return moved;
}

}  // namespace scanrig::ctl::doctor
