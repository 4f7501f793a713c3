#include <cstdio>

#include "daemon/ctl/doctor/examine.h"
#include "daemon/ctl/doctor/inventory.h"
#include "daemon/ctl/offline_rig_config.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {

ExitCode examine_rig(const DoctorVerb& verb) {
  const auto rig = offline_rig_config(verb.config);
  if (!rig) return report_error(rig.error());
  RealClock clock;
  const doctor::Operator person(verb.answers, verb.json);
  doctor::Report report;
  doctor::list_what_is_connected(report);
  const bool drive_answers = doctor::examine_drive(*rig, clock, report);
  const bool estop_works = doctor::examine_panel(*rig, drive_answers, person, clock, report);
  const auto may_turn = [&] { return verb.yes_move || person.ask("Is everyone clear? Turn the table? [y/N]") == "y"; };
  Result<void> moved;
  if (drive_answers && estop_works && may_turn()) {
    moved = doctor::examine_motion({*rig, verb.config}, person, clock, report);
  }
  doctor::print_missing_snippets(rig->turntable.device(), verb.config, report);
  fmt::print("{}", verb.json ? report.json() : report.text());
  if (!moved) return report_error(moved.error());
  const auto found = report.findings().size();
  if (found == 0) return ExitCode::ok;
  return report_error(ExitCode::device,
                      fmt::format("{}: {} finding(s); with each stands what to do", verb.config.string(), found));
}

}  // namespace scanrig::ctl
