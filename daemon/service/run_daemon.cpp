#include "daemon/service/run_daemon.h"

#include <algorithm>
#include <ctime>
#include <mutex>

#include "daemon/jobs/heap.h"
#include "daemon/jobs/housekeeping_thread.h"
#include "daemon/journal/log_entries.h"
#include "daemon/rig/panel_thread.h"
#include "daemon/rig/rig_thread.h"
#include "daemon/rig/turntable_thread.h"
#include "daemon/runtime/overloaded.h"
#include "daemon/service/exit_watchdog.h"
#include "daemon/service/safety_record.h"
#include "daemon/station/timestamp.h"
#include "daemon/webhook/webhook.h"

namespace scanrig {
namespace {

/// The serial number distinguishes jobs of one second; a listed one is never taken. The disk is not checked: it may
/// hang, and a folder put there by another program is not overwritten later either.
class NewIds {
 public:
  std::string operator()(const JobTable& known) {
    using namespace std::chrono;
    const auto now = floor<seconds>(system_clock::now());
    if (now != second_) serial_ = 0;
    second_ = now;
    std::string id;
    do {
      id = job_id(now, ++serial_);
    } while (known.contains(id));
    return id;
  }

 private:
  std::chrono::sys_seconds second_{};
  int serial_ = 0;
};

/// Lets other threads use the loop for as long as this lives.
class OnLoop {
 public:
  OnLoop(const DaemonOptions& options, ControlLoop& loop) : options_(options) { options.on_loop(loop); }
  ~OnLoop() { options_.loop_ends(); }
  OnLoop(const OnLoop&) = delete;
  OnLoop& operator=(const OnLoop&) = delete;

 private:
  const DaemonOptions& options_;
};

/// Entries of the log also go to the log of their job, while its thread runs.
class JobLogs {
 public:
  explicit JobLogs(const std::function<void(JournalEntry)>& journal) : journal_(journal) {}
  void write(JournalEntry entry) {
    {
      const std::lock_guard guard(mutex_);
      if (jobs_ && !entry.job.empty()) jobs_->log(entry);
    }
    journal_(std::move(entry));
  }
  void attach(JobThread* jobs) {
    const std::lock_guard guard(mutex_);
    jobs_ = jobs;
  }

 private:
  const std::function<void(JournalEntry)>& journal_;
  std::mutex mutex_;
  JobThread* jobs_ = nullptr;
};

class Attached {
 public:
  Attached(JobLogs& logs, JobThread& jobs) : logs_(logs) { logs_.attach(&jobs); }
  ~Attached() { logs_.attach(nullptr); }
  Attached(const Attached&) = delete;
  Attached& operator=(const Attached&) = delete;

 private:
  JobLogs& logs_;
};

struct Workers {
  RigThread& rig;
  OutsideStop& outside;
  JobThread& jobs;
  HousekeepingThread& housekeeping;
};

/// Longer work is kept away from the thread that stores views.
void keep(const action::RunJobRequest& task, const Workers& workers) {
  using What = event::JobRequested::What;
  const auto what = task.asked.what;
  if (what == What::remove || what == What::bundle) return workers.housekeeping.post(task.asked);
  workers.jobs.post(task);
}

bool cameras_are_free(const Snapshot& snapshot) {
  return snapshot.activity == Activity::none || snapshot.activity == Activity::waiting_for_flip ||
         snapshot.activity == Activity::waiting_for_part;
}

void perform(const Action& action, const Workers& workers) {
  auto& rig = workers.rig;
  std::visit(
      Overloaded{[](const action::Warn&) {},  // these are the control loop's own
                 [](const action::WaitForEstop&) {}, [](const action::RetryStopLater&) {},
                 [](const action::EndConsentLater&) {}, [](const action::CheckLater&) {},
                 [](const action::TestLamps&) {}, [](const action::WaitForFlip&) {},
                 [&](const action::Home&) { rig.home(); }, [&](const action::StopRig&) { rig.stop(); },
                 [&](const action::StopTableDirectly&) { rig.stop_directly(); },
                 [&](const action::StopTableOutside&) { workers.outside.begin(); },
                 [&](const action::TakeView& a) { rig.take_view(a); }, [&](const action::Jog& a) { rig.jog(a); },
                 [&](const action::Pulse&) { rig.pulse(); }, [&](const action::CheckDevices&) { rig.check_devices(); },
                 [&](const action::RunJobRequest& a) { keep(a, workers); },
                 [&](const auto& task) { workers.jobs.post(task); }},
      action);
}

/// Jobs that the last daemon left to be reconstructed.
void go_on_reconstructing(const JobTable& jobs, ReconstructionThread& reconstruction) {
  for (const auto& [id, job] : jobs) {
    if (job->state == JobState::reconstructing) reconstruction.rebuild(id, job->folder, job->recipe, {});
  }
}

std::optional<Error> disk_problem(Clock::Duration waiting, const DaemonOptions& options) {
  if (waiting < options.disk_limit) return std::nullopt;
  return Error{ErrorCode::io,
               fmt::format("the disk with {} has not responded for {} s; check it", options.jobs.root.string(),
                           std::chrono::duration_cast<std::chrono::seconds>(waiting).count())};
}

/// The record of one run, if there is one. An end counts as unexpected unless no devices were in use.
class RecordedRun {
 public:
  explicit RecordedRun(const std::filesystem::path& state_folder) {
    if (state_folder.empty()) return;
    record_.emplace(state_folder);
    auto latch = record_->begin();
    // Where nothing can be read, the last process may have left a fault: a person has to check first.
    latch_ = latch ? std::move(*latch) : Latch{as_sentence(latch.error().message)};
  }
  ~RecordedRun() {
    writer_.reset();
    if (record_ && !uses_devices_) std::ignore = record_->end();
  }
  RecordedRun(const RecordedRun&) = delete;
  RecordedRun& operator=(const RecordedRun&) = delete;

  [[nodiscard]] const std::optional<Latch>& latch() const { return latch_; }
  void begin_devices() {
    uses_devices_ = true;
    if (record_) writer_.emplace(*record_);
  }
  void end_devices() { uses_devices_ = false; }
  Result<void> store(const std::optional<Latch>& latch) { return writer_ ? writer_->store(latch) : Result<void>(); }

 private:
  std::optional<SafetyRecord> record_;
  std::optional<LatchWriter> writer_;
  std::optional<Latch> latch_;
  bool uses_devices_ = false;
};

/// Uses this machine's wall clock.
bool quiet_now(const std::optional<QuietHours>& hours) {
  if (!hours) return false;
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm local{};
  ::localtime_r(&now, &local);
  return hours->contain(std::chrono::hours(local.tm_hour) + std::chrono::minutes(local.tm_min));
}

}  // namespace

Result<Ended> run_daemon(const Devices& devices, const DaemonOptions& options, Clock& clock, std::stop_token stop) {
  keep_heaps_small();
  ExitWatchdog ending(options.exit_timeout, options.on_exit_hang);
  auto store = JobStore::open(options.jobs);
  if (!store) return pass_on(store);
  auto known = store->recover();
  if (!known) return pass_on(known);

  RecordedRun record(options.state_folder);
  const StationRules rules{.recipes = options.recipes,
                           .remote = options.remote,
                           .guard = options.guard,
                           .auto_home = options.auto_home,
                           .manual_light = options.manual_light};
  ControlLoopOptions loop_options{.rules = rules,
                                  .warning = options.warning,
                                  .hang_limit = options.hang_limit,
                                  .warm_up = options.warm_up,
                                  .latch = record.latch()};
  loop_options.estop_window = std::max(loop_options.estop_window, panel_latency(options.panel_read_time));
  ControlLoop loop(clock, loop_options, *known);
  const auto post_event = [&loop](Event event) { loop.post(std::move(event)); };

  JobLogs logs(options.journal);
  const OnLoop reachable(options, loop);
  Preview preview(clock, [&loop] { return cameras_are_free(*loop.snapshot()); });
  auto api_options = options.api;
  api_options.storage = store->options().root;
  api_options.journal = [&logs](JournalEntry entry) { logs.write(std::move(entry)); };
  api_options.preview_jpeg = [&preview](std::string_view side) {
    return preview.jpeg(side == "left" ? Side::left : Side::right);
  };
  auto api = ApiServer::start(api_options, loop);
  if (!api) return pass_on(api);
  if (auto may = options.takes_devices(); !may) return pass_on(may);
  record.begin_devices();

  // Time stands still until every thread runs. They end in reverse order. The panel shows the last lamps, the rig's
  // standstill is confirmed, views go to disk, then the reconstruction that all of them feed is stopped.
  std::optional<Clock::Busy> starting(clock);
  ReconstructionThread reconstruction(clock, options.reconstructor, post_event);
  go_on_reconstructing(*known, reconstruction);
  auto in_bundle = options.bundle;
  in_bundle.calibration_file = options.jobs.calibration_file;
  in_bundle.reserve_bytes = options.jobs.reserve_bytes;
  HousekeepingThread housekeeping(
      clock, *store, options.retention, [&loop] { return loop.snapshot()->jobs; }, post_event, in_bundle);
  housekeeping.sweep();
  JobThread jobs(clock, *store, reconstruction, options.on_scanned, post_event);
  const Attached attached(logs, jobs);
  RigThread rig(devices, clock, options.acquisition, preview, post_event, options.hang_margin);
  OutsideStop outside(clock, options.stop_table_outside, post_event);
  const auto store_latch = [&](const std::optional<Latch>& latch) {
    if (auto stored = record.store(latch); !stored) {
      logs.write({Priority::error, as_sentence(stored.error().message)});
    }
  };
  std::optional<Webhook> webhook;
  if (options.webhook) webhook.emplace(clock, *options.webhook);
  PanelThread panel(devices.panel, clock, {options.panel_read_time, options.hang_margin}, post_event,
                    [&rig] { rig.interrupt(); });

  const std::stop_callback shut_down(stop, [&loop] { loop.post(event::Shutdown{}); });
  const Clock::Actor actor(clock);
  starting.reset();
  const Workers workers{rig, outside, jobs, housekeeping};
  NewIds new_id;
  const auto perform_all = [&](const Action& action) {
    perform(action, workers);
    if (std::holds_alternative<action::StartJob>(action)) housekeeping.sweep();
  };
  const auto published = [&, told = loop.snapshot()](const std::shared_ptr<const Snapshot>& snapshot) mutable {
    for (auto& line : log_entries(*std::exchange(told, snapshot), *snapshot)) logs.write(std::move(line));
    if (webhook) webhook->look(snapshot);
    options.published(snapshot);
    (*api)->wake();
  };
  const auto refused = [&](const event::Pressed& pressed, const Error& why) {
    logs.write(refused_at_panel(pressed, why, *loop.snapshot()));
  };
  auto ended = loop.run({.alive = [&] { options.alive(loop.snapshot()->sentence); },
                         .perform = perform_all,
                         .show = [&](const PanelOutputs& outputs) { panel.show(outputs); },
                         .store_latch = store_latch,
                         .new_job_id = [&] { return new_id(loop.snapshot()->jobs); },
                         .quiet_hours = [&] { return quiet_now(options.quiet_hours); },
                         .disk_problem = [&] { return disk_problem(jobs.waiting(), options); },
                         .rig_hangs = [&] { return rig.hung(); },
                         .panel_hangs = [&] { return panel.hung(); },
                         .published = published,
                         .refused_at_panel = refused});
  const auto hung = ended ? std::nullopt : rig.hung() ? rig.hung() : panel.hung();
  ending.begin(hung ? std::optional(hung_error(*hung)) : std::nullopt);
  reconstruction.stop();  // before views that are still being stored use up its time
  if (ended) record.end_devices();
  return ended;
}

}  // namespace scanrig
