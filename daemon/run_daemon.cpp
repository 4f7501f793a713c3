#include "daemon/run_daemon.h"

#include "daemon/api/server.h"
#include "daemon/overloaded.h"
#include "daemon/rig/panel_thread.h"
#include "daemon/rig/rig_thread.h"
#include "daemon/service_manager.h"
#include "daemon/station/timestamp.h"

namespace scanrig {
namespace {

/// The serial number tells apart jobs of one second; a folder that is already there is never taken.
std::string fresh_job_id(const std::filesystem::path& root) {
  const auto now = std::chrono::system_clock::now();
  std::error_code ignored;
  for (int serial = 1;; ++serial) {
    auto id = job_id(now, serial);
    if (!std::filesystem::exists(root / id, ignored)) return id;
  }
}

bool cameras_are_free(const Snapshot& snapshot) {
  return snapshot.activity == Activity::none || snapshot.activity == Activity::waiting_for_flip;
}

void perform(const Action& action, RigThread& rig, JobThread& jobs) {
  std::visit(
      Overloaded{[](const action::Warn&) {},  // these are the control loop's own
                 [](const action::WaitForEstop&) {}, [](const action::RetryStopLater&) {},
                 [](const action::CheckLater&) {}, [](const action::TestLamps&) {},
                 [&](const action::Home&) { rig.home(); }, [&](const action::StopRig&) { rig.stop(); },
                 [&](const action::TakeView& a) { rig.take_view(a); }, [&](const action::Jog& a) { rig.jog(a); },
                 [&](const action::Pulse&) { rig.pulse(); }, [&](const action::CheckDevices&) { rig.check_devices(); },
                 [&](const auto& task) { jobs.post(task); }},
      action);
}

}  // namespace

Result<void> run_daemon(const Devices& devices, const DaemonOptions& options, Clock& clock, std::stop_token stop) {
  auto store = JobStore::open(options.jobs);
  if (!store) return pass_on(store);
  auto known = store->recover();
  if (!known) return pass_on(known);

  const StationRules rules{.poses = options.jobs.poses,
                           .views = options.jobs.views,
                           .remote = options.remote,
                           .guard = options.guard,
                           .home_guarded = options.home_guarded,
                           .manual_light = options.manual_light};
  ControlLoop loop(clock, {.rules = rules, .warning = options.warning}, std::move(*known));
  const auto tell = [&loop](Event event) { loop.post(std::move(event)); };

  Preview preview(clock, [&loop] { return cameras_are_free(*loop.snapshot()); });
  auto api = ApiServer::start(options.socket, loop, preview);
  if (!api) return pass_on(api);

  // Time stands until every thread is there. They end in reverse order: the panel shows the last lamps, the rig is
  // seen standing, what was taken goes to disk, then the reconstruction that all of them feed is stopped.
  std::optional<Clock::Busy> starting(clock);
  ReconstructionThread reconstruction(clock, options.reconstructor, rules.poses, rules.views, tell);
  JobThread jobs(clock, *store, reconstruction, options.on_scanned, tell);
  RigThread rig(devices, clock, options.acquisition, preview, tell);
  PanelThread panel(devices.panel, clock, tell, [&rig] { rig.interrupt(); });

  const std::stop_callback shut_down(stop, [&loop] { loop.post(event::Shutdown{}); });
  const Clock::Actor actor(clock);
  starting.reset();
  ServiceManager manager;
  return loop.run({.alive = [&] { manager.alive(loop.snapshot()->sentence); },
                   .perform = [&](const Action& action) { perform(action, rig, jobs); },
                   .show = [&](const PanelOutputs& outputs) { panel.show(outputs); },
                   .fresh_job_id = [&] { return fresh_job_id(options.jobs.root); }});
}

}  // namespace scanrig
