#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/ctl/offline_rig_config.h"
#include "daemon/ctl/verbs.h"
#include "daemon/rig/open_devices.h"
#include "daemon/runtime/signal_stop.h"

namespace scanrig::ctl {
namespace {

constexpr std::chrono::milliseconds kGlance{200};

void tell(const PanelInputs& now, Clock::Duration since) {
  fmt::print("{:9.3f} s  e-stop {}  guard {}  part {}  {}{}{}\n", std::chrono::duration<double>(since).count(),
             now.estop_ok ? "ok" : "PRESSED", now.guard_closed ? "closed" : "OPEN", now.part_present ? "there" : "-",
             now.start ? "[start]" : "", now.stop ? "[stop]" : "", now.reset ? "[reset]" : "");
  std::fflush(stdout);
}

void tell_json(const PanelInputs& now, Clock::Duration since) {
  fmt::print("{}\n", nlohmann::ordered_json{{"after_s", std::chrono::duration<double>(since).count()},
                                            {"estop_ok", now.estop_ok},
                                            {"guard_closed", now.guard_closed},
                                            {"part_present", now.part_present},
                                            {"flipped", now.flipped},
                                            {"start", now.start},
                                            {"stop", now.stop},
                                            {"reset", now.reset}}
                         .dump());
  std::fflush(stdout);
}

}  // namespace

ExitCode watch_panel(const PanelVerb& verb) {
  const auto rig = offline_rig_config(verb.config);
  if (!rig) return report_error(rig.error());
  RealClock clock;
  const auto open = open_devices(*rig, clock);
  if (!open) return report_error(open.error());
  const SignalStop signal;
  const auto begun = clock.now();
  const auto end = verb.seconds > 0 ? begun + std::chrono::seconds(verb.seconds) : Clock::TimePoint::max();
  PanelInputs known;
  for (bool first = true; !signal.token().stop_requested() && clock.now() < end; first = false) {
    const auto now = open->panel->wait_change(known, Deadline::after(clock, first ? Clock::Duration{} : kGlance));
    if (!now) return report_error(of_device(now.error()));
    if (first || *now != known) (verb.json ? tell_json : tell)(*now, clock.now() - begun);
    known = *now;
  }
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
