#include "daemon/service/run_daemon.h"

#include <algorithm>
#include <ctime>
#include <mutex>

#include "core/heap.h"
#include "core/overloaded.h"
#include "core/timestamp.h"
#include "daemon/jobs/housekeeping_thread.h"
#include "daemon/journal/log_entries.h"
#include "daemon/rig/panel_thread.h"
#include "daemon/rig/preview.h"
#include "daemon/rig/rig_thread.h"
#include "daemon/rig/turntable_thread.h"
#include "daemon/service/exit_watchdog.h"
#include "daemon/service/safety_record.h"
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

/// Entries of the log also go to the log of their job, while its thread runs, and to the page.
class JobLogs {
 public:
  explicit JobLogs(const std::function<void(JournalEntry)>& journal) : journal_(journal) {}
  void write(JournalEntry entry) {
    {
      const std::lock_guard guard(mutex_);
      if (jobs_ && !entry.job.empty()) jobs_->log(entry);
    }
    recent_.write(entry);
    journal_(std::move(entry));
  }
  [[nodiscard]] const RecentLog& recent() const { return recent_; }
  void attach(JobThread* jobs) {
    const std::lock_guard guard(mutex_);
    jobs_ = jobs;
  }

 private:
  const std::function<void(JournalEntry)>& journal_;
  std::mutex mutex_;
  JobThread* jobs_ = nullptr;
  RecentLog recent_;
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

bool cameras_are_free(const Snapshot& snapshot) {
  return snapshot.activity == Activity::none || snapshot.activity == Activity::waiting_for_flip ||
         snapshot.activity == Activity::waiting_for_part;
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

ControlLoopOptions loop_options(const DaemonOptions& options, const std::optional<Latch>& latch) {
  const StationRules rules{
      .recipes = options.recipes,
      .remote = options.remote,
      .guard = options.guard,
      .auto_home = options.auto_home,
      .manual_light = options.manual_light,
      .calibration = options.calibrator.solver ? std::optional(calibration_recipe()) : std::nullopt,
      .accepts_calibrations = options.accepts_calibrations,
      .lent = options.lent};
  ControlLoopOptions for_loop{.rules = rules,
                              .warning = options.warning,
                              .hang_limit = options.hang_limit,
                              .warm_up = options.warm_up,
                              .latch = latch};
  for_loop.estop_window = std::max(for_loop.estop_window, panel_latency(options.panel_read_time));
  return for_loop;
}

ApiOptions api_options(const DaemonOptions& options, const JobStore& store, JobLogs& logs, Preview& preview,
                       PlacementAid& aid) {
  auto for_api = options.api;
  for_api.storage = store.options().root;
  for_api.journal = [&logs](JournalEntry entry) { logs.write(std::move(entry)); };
  for_api.log = &logs.recent();
  for_api.preview_jpeg = [&preview](std::string_view side, bool is_middle) {
    return preview.jpeg(side == "left" ? Side::left : Side::right, is_middle ? Extent::middle : Extent::whole);
  };
  for_api.look_at_board = [&aid](const AwaitedPlacement& awaited) { return aid.look(awaited); };
  return for_api;
}

BundleOptions bundle_options(const DaemonOptions& options) {
  auto for_bundles = options.bundle;
  for_bundles.calibration_file = options.jobs.calibration_file;
  for_bundles.reserve_bytes = options.jobs.reserve_bytes;
  return for_bundles;
}

/// Objects that the threads of a run use, and that outlive them.
struct Shared {
  const DaemonOptions& options;
  Clock& clock;
  const JobStore& store;
  ControlLoop& loop;
  JobLogs& logs;
  Preview& preview;
  RecordedRun& record;
};

/// The threads of a run, all but the API's. They end in reverse order. The panel shows the last lamps, the rig's
/// standstill is confirmed, views go to disk, then the reconstruction that all of them feed is stopped.
struct Threads {
  Threads(const Devices& devices, const Shared& shared)
      : post_event([&loop = shared.loop](Event event) { loop.post(std::move(event)); }),
        reconstruction(shared.clock, shared.options.reconstructor, post_event,
                       shared.options.calibrator.solver ? calibrator(shared.options.calibrator) : CalibratorFactory{}),
        housekeeping(
            shared.clock, shared.store, shared.options.retention,
            [&loop = shared.loop] { return loop.snapshot()->jobs; }, post_event, bundle_options(shared.options)),
        jobs(shared.clock, shared.store, reconstruction, shared.options.on_scanned, post_event),
        attached(shared.logs, jobs),
        rig(devices, shared.clock, shared.options.acquisition, shared.preview, post_event, shared.options.hang_margin),
        outside(shared.clock, shared.options.stop_table_outside, post_event),
        panel(devices.panel, shared.clock, {shared.options.panel_read_time, shared.options.hang_margin}, post_event,
              [this] { rig.interrupt(); }) {
    if (shared.options.webhook) webhook.emplace(shared.clock, *shared.options.webhook);
  }
  /// The call of a device that hangs.
  [[nodiscard]] std::optional<HungCall> hung() const {
    const auto call = rig.hung();
    return call ? call : panel.hung();
  }

  const std::function<void(Event)> post_event;
  ReconstructionThread reconstruction;
  HousekeepingThread housekeeping;
  JobThread jobs;
  const Attached attached;
  RigThread rig;
  OutsideStop outside;
  std::optional<Webhook> webhook;
  PanelThread panel;
};

/// Longer work is kept away from the thread that stores views.
void keep(const action::RunJobRequest& task, Threads& threads) {
  using What = event::JobRequested::What;
  const auto what = task.asked.what;
  if (what == What::remove || what == What::bundle) return threads.housekeeping.post(task.asked);
  threads.jobs.post(task);
}

void perform(const Action& action, Threads& threads) {
  auto& rig = threads.rig;
  std::visit(
      Overloaded{[](const action::Warn&) {},  // these are the control loop's own
                 [](const action::WaitForEstop&) {}, [](const action::RetryStopLater&) {},
                 [](const action::EndConsentLater&) {}, [](const action::CheckLater&) {},
                 [](const action::TestLamps&) {}, [](const action::WaitForFlip&) {},
                 [&](const action::Home&) { rig.home(); }, [&](const action::StopRig&) { rig.stop(); },
                 [&](const action::StopTableDirectly&) { rig.stop_directly(); },
                 [&](const action::StopTableOutside&) { threads.outside.begin(); },
                 [&](const action::TakeView& a) { rig.take_view(a); }, [&](const action::TurnTo& a) { rig.turn_to(a); },
                 [&](const action::Jog& a) { rig.jog(a); }, [&](const action::Pulse&) { rig.pulse(); },
                 [&](const action::CheckDevices&) { rig.check_devices(); },
                 [&](const action::RunJobRequest& a) { keep(a, threads); },
                 [&](const auto& task) { threads.jobs.post(task); }},
      action);
}

/// Connections of the control loop to the rest of the service.
StationPorts ports_of(const Shared& shared, Threads& threads, ApiServer& api) {
  const auto perform_all = [&threads](const Action& action) {
    perform(action, threads);
    if (std::holds_alternative<action::StartJob>(action)) threads.housekeeping.sweep();
  };
  const auto store_latch = [&record = shared.record, &logs = shared.logs](const std::optional<Latch>& latch) {
    if (auto stored = record.store(latch); !stored) {
      logs.write({Priority::error, as_sentence(stored.error().message)});
    }
  };
  const auto published = [shared, &threads, &api,
                          last = shared.loop.snapshot()](const std::shared_ptr<const Snapshot>& snapshot) mutable {
    for (auto& line : log_entries(*std::exchange(last, snapshot), *snapshot)) shared.logs.write(std::move(line));
    if (threads.webhook) threads.webhook->look(snapshot);
    shared.options.published(snapshot);
    api.wake();
  };
  const auto refused = [shared](const event::Pressed& pressed, const Error& why) {
    shared.logs.write(refused_at_panel(pressed, why, *shared.loop.snapshot()));
  };
  return {.alive = [shared] { shared.options.alive(shared.loop.snapshot()->sentence); },
          .perform = perform_all,
          .show = [&threads](const PanelOutputs& outputs) { threads.panel.show(outputs); },
          .store_latch = store_latch,
          .new_job_id = [new_id = NewIds(), &loop = shared.loop]() mutable { return new_id(loop.snapshot()->jobs); },
          .quiet_hours = [shared] { return quiet_now(shared.options.quiet_hours); },
          .disk_problem = [shared, &threads] { return disk_problem(threads.jobs.waiting(), shared.options); },
          .rig_hangs = [&threads] { return threads.rig.hung(); },
          .panel_hangs = [&threads] { return threads.panel.hung(); },
          .published = published,
          .refused_at_panel = refused};
}

}  // namespace

Result<Ended> run_daemon(const Devices& devices, const DaemonOptions& options, Clock& clock,
                         const std::stop_token& stop) {
  keep_heaps_small();
  ExitWatchdog ending(options.exit_timeout, options.on_exit_hang);
  auto store = JobStore::open(options.jobs);
  if (!store) return pass_on(store);
  auto known = store->recover();
  if (!known) return pass_on(known);

  RecordedRun record(options.state_folder);
  ControlLoop loop(clock, loop_options(options, record.latch()), *known);
  JobLogs logs(options.journal);
  const OnLoop reachable(options, loop);
  Preview preview(clock, [&loop] { return cameras_are_free(*loop.snapshot()); });
  PlacementAid aid(clock, preview, options.calibrator.board, options.jobs.calibration_file);
  auto api = ApiServer::start(api_options(options, *store, logs, preview, aid), loop);
  if (!api) return pass_on(api);
  if (auto may = options.takes_devices(); !may) return pass_on(may);
  record.begin_devices();

  std::optional<Clock::Busy> starting(clock);  // time does not pass until every thread runs
  const Shared shared{options, clock, *store, loop, logs, preview, record};
  Threads threads(devices, shared);
  go_on_reconstructing(*known, threads.reconstruction);
  threads.housekeeping.sweep();
  const std::stop_callback shut_down(stop, [&loop] { loop.post(event::Shutdown{}); });
  const Clock::Actor actor(clock);
  starting.reset();
  auto ended = loop.run(ports_of(shared, threads, **api));
  const auto hung = ended ? std::nullopt : threads.hung();
  ending.begin(hung ? std::optional(hung_error(*hung)) : std::nullopt);
  threads.reconstruction.stop();  // before views that are still being stored use up its time
  if (ended) record.end_devices();
  return ended;
}

}  // namespace scanrig
