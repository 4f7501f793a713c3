#include "daemon/jobs/reconstruction_thread.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "core/catch_exceptions.h"
#include "core/heap.h"
#include "core/priority.h"
#include "daemon/jobs/job_files.h"
#include "daemon/runtime/actor.h"
#include "daemon/station/job_lifecycle.h"

namespace scanrig {
namespace {

/// Limit of views in memory while an earlier job is being reconstructed.
constexpr int kMaxViewsWaiting = 4;

constexpr const char* kWork = "the reconstruction";

}  // namespace

ReconstructionThread::ReconstructionThread(Clock& clock, ReconstructorFactory factory,
                                           std::function<void(Event)> post_event, CalibratorFactory calibrator)
    : factory_(std::move(factory)),
      calibrator_(std::move(calibrator)),
      post_event_(std::move(post_event)),
      inbox_(clock),
      thread_(start_actor(clock, [this] { run(); })) {}

ReconstructionThread::~ReconstructionThread() {
  stop();
  inbox_.close();
  thread_.join();
}

void ReconstructionThread::stop() {
  ending_ = true;
  {
    const std::lock_guard guard(mutex_);
    for (auto& run : runs_) run.stop.request_stop();
  }
  unmark();
}

Result<void> ReconstructionThread::mark() {
  const std::lock_guard guard(mutex_);
  if (ending_) return fail(ErrorCode::stopped, "stopped by request");
  if (marked_) return {};
  if (auto begun = begin_attempt(current_->folder); !begun) return begun;
  marked_ = current_->folder;
  return {};
}

void ReconstructionThread::unmark() {
  const std::lock_guard guard(mutex_);
  if (marked_) forget_attempts(*marked_);
  marked_.reset();
}

void ReconstructionThread::begin(std::string job, ScanFolder scan, Recipe recipe) {
  auto begin = enlist(std::move(job), scan.path(), std::move(recipe), {});
  begin.scan = std::move(scan);
  inbox_.post(std::move(begin));
}

void ReconstructionThread::rebuild(std::string job, std::filesystem::path folder, Recipe recipe,
                                   ReconstructionChanges changes) {
  inbox_.post(Rebuild{enlist(std::move(job), std::move(folder), std::move(recipe), std::move(changes))});
}

bool ReconstructionThread::cancel(const std::string& job) {
  const std::lock_guard guard(mutex_);
  bool found = false;
  for (auto& run : runs_) {
    if (run.job == job) found = run.stop.request_stop() || found;
  }
  return found;
}

bool ReconstructionThread::has(const std::string& job) {
  const std::lock_guard guard(mutex_);
  return std::ranges::any_of(runs_, [&](const Run& run) { return run.job == job && !run.stop.stop_requested(); });
}

ReconstructionThread::Begin ReconstructionThread::enlist(std::string job, std::filesystem::path folder, Recipe recipe,
                                                         ReconstructionChanges changes) {
  const std::lock_guard guard(mutex_);
  const auto& run = runs_.emplace_back(Run{job, {}});
  return {std::move(job), std::move(folder), std::move(recipe), std::move(changes), run.stop};
}

/// Ends the work; false when it was cancelled before. From then on it cannot be cancelled.
bool ReconstructionThread::dismiss(const std::stop_source& stop) {
  const std::lock_guard guard(mutex_);
  runs_.remove_if([&](const Run& run) { return run.stop == stop; });
  return !stop.stop_requested();
}

void ReconstructionThread::add_view(std::shared_ptr<const TakenView> view) {
  const auto id = view->id;
  if (++views_waiting_ > kMaxViewsWaiting) {
    --views_waiting_;
    view.reset();
  }
  inbox_.post(AddView{id, std::move(view)});
}

void ReconstructionThread::run() {
  lower_priority();
  while (auto message = inbox_.take()) {
    if (ending_) continue;
    std::visit([this](const auto& m) { perform(m); }, *message);
    while (!current_ && !rebuilds_.empty() && !ending_) {
      const auto next = std::move(rebuilds_.front());
      rebuilds_.pop_front();
      perform(next);
      perform(Finish{next.job});
    }
  }
  if (current_) end();  // requested to stop: not the job's fault
}

/// An exception outside the pipeline also fails only this job.
template <class SomeMessage>
void ReconstructionThread::perform(const SomeMessage& message) {
  const auto done = catch_exceptions(kWork, [&]() -> Result<void> {
    handle(message);
    return {};
  });
  if (done || !current_) return;
  check(done);
  if constexpr (std::is_same_v<SomeMessage, Finish>) end();  // otherwise the job would never end
}

bool ReconstructionThread::works_on(const std::string& job) const {
  return current_ && current_->job == job && !current_->error && !current_->quarantined &&
         !current_->stop.stop_requested();
}

void ReconstructionThread::handle(const Begin& message) {
  current_ = Current{.job = message.job, .folder = message.folder, .recipe = message.recipe, .stop = message.stop};
  told_stage_.clear();
  const auto scan = message.scan ? Result<ScanFolder>(*message.scan) : ScanFolder::open(message.folder);
  if (!scan) return check(pass_on(scan));
  check(start(message, *scan));
  if (works_on(message.job)) check(catch_up(*scan));
}

Result<void> ReconstructionThread::start(const Begin& message, const ScanFolder& scan) {
  current_->quarantined = is_to_be_quarantined(read_attempt_record(message.folder).ended_by_death);
  if (current_->quarantined) return {};
  if (scan.manifest().state == "scanned") {
    if (auto marked = mark(); !marked) return marked;
  }
  return catch_exceptions(kWork, [&]() -> Result<void> {
    auto made = make_reconstructor(message, scan);
    if (!made) return pass_on(made);
    current_->reconstructor = std::move(*made);
    return {};
  });
}

Result<std::unique_ptr<Reconstructor>> ReconstructionThread::make_reconstructor(const Begin& message,
                                                                                const ScanFolder& scan) {
  const auto& recipe = message.recipe;
  if (recipe.is_calibration()) {
    if (!calibrator_) return fail(ErrorCode::unsupported, "this service cannot solve a calibration");
    const auto report = [this, job = message.job](int pose, int view, std::vector<std::string> problems) {
      post_event_(event::ImagesChecked{{job, pose, view}, std::move(problems)});
    };
    return calibrator_({.folder = message.folder, .is_check = recipe.is_check(), .report = report});
  }
  const auto calibration = scan.load_calibration();
  if (!calibration) return pass_on(calibration);
  return factory_({.calibration = *calibration,
                   .folder = message.folder,
                   .views = recipe.all_views(),
                   .fixture = recipe.fixture,
                   .changes = message.changes,
                   .is_ending = [this] { return ending_.load(); }});
}

/// Takes the earlier views of a job that is resumed or reprocessed.
Result<void> ReconstructionThread::catch_up(const ScanFolder& scan) {
  const auto& poses = scan.manifest().poses;
  for (std::size_t pose = 0; pose < poses.size(); ++pose) {
    for (std::size_t view = 0; view < poses[pose].views.size(); ++view) {
      if (current_->stop.stop_requested()) return fail(ErrorCode::stopped, "stopped by request");
      if (auto added = add_stored(scan, pose, view); !added) return added;
    }
    if (!poses[pose].complete) break;
    if (auto closed = close_pose(static_cast<int>(pose)); !closed) return closed;
  }
  return {};
}

void ReconstructionThread::handle(const Rebuild& message) { rebuilds_.push_back(message.begin); }

Result<void> ReconstructionThread::add_stored(const ScanFolder& scan, std::size_t pose, std::size_t view) {
  const auto raw = scan.load_raw(pose, view);
  if (!raw) return pass_on(raw);
  return add(static_cast<int>(pose), *raw, scan.manifest().poses[pose].views[view]);
}

Result<void> ReconstructionThread::add(int pose, const RawView& raw, const ViewRecord& record) {
  // One stage for all views of the scan: its bar covers the time in which the table turns.
  const int views = current_->recipe.all_views();
  const char* const stage = current_->recipe.is_calibration() ? "images" : "range";
  const auto progress = [&](std::string_view, double fraction) {
    tell_progress(stage, std::min(1.0, (current_->views_done + fraction) / views));
  };
  auto added = catch_exceptions(kWork, [&] {
    return current_->reconstructor->add_view(static_cast<std::size_t>(pose), raw, record, context(progress));
  });
  ++current_->views_done;
  progress(stage, 0.0);
  if (added) {
    const bool is_first = record.index == 0;
    show(fmt::format("pose{}_view{:02}", pose + 1, record.index),
         current_->reconstructor->live_view(static_cast<std::size_t>(pose)), is_first);
  }
  return added ? close_when_whole(pose, record.index) : added;
}

/// The first view is taken once more, to see whether anything moved. Meanwhile the pose is closed: a scan in which
/// something has moved gets no model.
Result<void> ReconstructionThread::close_when_whole(int pose, int view) {
  const Recipe& recipe = current_->recipe;
  if (recipe.is_calibration() || view + 1 < recipe.views_of(pose)) return {};
  auto closed = close_pose(pose);
  // In its turn, after what may have come to end the job.
  if (closed && pose + 1 == recipe.poses) inbox_.post(Prepare{current_->job});
  return closed;
}

void ReconstructionThread::handle(const AddView& message) {
  if (message.view) --views_waiting_;
  if (!works_on(message.id.job)) return;
  if (message.view) return check(add(message.id.pose, message.view->images, message.view->record));
  const auto scan = ScanFolder::open(current_->folder);
  if (!scan) return check(pass_on(scan));
  check(add_stored(*scan, static_cast<std::size_t>(message.id.pose), static_cast<std::size_t>(message.id.view)));
}

Result<void> ReconstructionThread::close_pose(int pose) {
  if (pose < current_->poses_closed) return {};
  const auto progress = [&](std::string_view stage, double fraction) {
    tell_progress(fmt::format("{} pose {}", stage, pose + 1), fraction);
  };
  auto closed = catch_exceptions(
      kWork, [&] { return current_->reconstructor->finish_pose(static_cast<std::size_t>(pose), context(progress)); });
  if (!closed) return closed;
  current_->poses_closed = pose + 1;
  // After the last pose the model itself is soon there.
  if (current_->poses_closed < current_->recipe.poses) {
    show(fmt::format("pose{}", pose + 1), current_->reconstructor->live_pose(static_cast<std::size_t>(pose)), true);
    suggest(pose);
  }
  return closed;
}

/// A mesh that cannot be written is not shown; the job does not need it. `replaces`: instead of those before.
void ReconstructionThread::show(std::string name, const std::string& glb, bool replaces) {
  if (glb.empty() || !write_live_file(current_->folder, name + ".glb", glb)) return;
  if (replaces) current_->live.clear();
  current_->live.push_back(std::move(name));
  post_event_(event::LiveMeshes{current_->job, current_->live});
}

/// How the part can be laid down next. An image that cannot be written is not shown.
void ReconstructionThread::suggest(int pose) {
  std::vector<SuggestedRest> rests;
  for (auto& [rest, png] : current_->reconstructor->suggestions(static_cast<std::size_t>(pose))) {
    const auto name = rest_image(static_cast<int>(rests.size()) + 1);
    rest.has_image = !png.empty() && write_live_file(current_->folder, name, png).has_value();
    rests.push_back(rest);
  }
  if (rests.empty()) return;
  current_->has_suggestions = true;
  post_event_(event::RestsSuggested{current_->job, std::move(rests)});
}

void ReconstructionThread::hide() {
  remove_live_files(current_->folder);
  if (!current_->live.empty()) post_event_(event::LiveMeshes{current_->job, {}});
  if (current_->has_suggestions) post_event_(event::RestsSuggested{current_->job, {}});
}

void ReconstructionThread::handle(const FinishPose& message) {
  if (works_on(message.job)) check(close_pose(message.pose));
}

/// A placement that no one can examine is not asked for again: its job fails for another reason.
void ReconstructionThread::handle(const CheckPlacement& message) {
  Result<void> enough;
  if (works_on(message.job)) {
    enough = catch_exceptions(
        kWork, [&] { return current_->reconstructor->check_pose(static_cast<std::size_t>(message.pose)); });
  }
  post_event_(
      event::PlacementChecked{message.job, message.pose, enough ? std::nullopt : std::optional(enough.error())});
}

void ReconstructionThread::handle(const DropPose& message) {
  if (works_on(message.job)) current_->reconstructor->drop_pose(static_cast<std::size_t>(message.pose));
}

void ReconstructionThread::handle(const Prepare& message) {
  if (!works_on(message.job)) return;
  if (auto marked = mark(); !marked) return check(marked);
  const auto progress = [this](std::string_view stage, double fraction) {
    tell_progress(std::string(stage), fraction);
  };
  check(catch_exceptions(kWork, [&] { return current_->reconstructor->prepare(context(progress)); }));
}

void ReconstructionThread::handle(const Finish& message) {
  if (!current_ || current_->job != message.job) return;
  if (current_->quarantined) check(tl::unexpected(quarantine_error()));
  std::optional<event::ModelReady> ready;
  if (works_on(message.job)) {
    auto made = make_model();
    if (made) {
      ready = std::move(*made);
    } else {
      check(pass_on(made));
    }
  }
  if (ending_) return;
  if (!dismiss(current_->stop)) return end();
  if (ready) {
    remove_failure(current_->folder);
  } else if (!current_->quarantined) {
    // A record that cannot be written costs the reason after a restart, nothing else.
    std::ignore = write_failure(current_->folder, *current_->error);
  }
  end();
  if (ready) post_event_(*std::move(ready));
}

void ReconstructionThread::handle(const Abandon& message) {
  if (current_ && current_->job == message.job) end();
}

void ReconstructionThread::end() {
  hide();
  unmark();
  std::ignore = dismiss(current_->stop);
  current_.reset();
  give_memory_back();
}

Result<event::ModelReady> ReconstructionThread::make_model() {
  if (auto marked = mark(); !marked) return pass_on(marked);
  const auto progress = [this](std::string_view stage, double fraction) {
    tell_progress(std::string(stage), fraction);
  };
  return catch_exceptions(kWork, [&]() -> Result<event::ModelReady> {
    const auto made = current_->reconstructor->finish(model_folder(current_->folder), context(progress));
    if (!made) return pass_on(made);
    const auto report = report_file(current_->folder);
    const auto& recipe = current_->recipe;
    return event::ModelReady{current_->job,
                             model_file(current_->folder, recipe.kind),
                             report,
                             limit_violation(report, recipe.limits),
                             recipe.is_calibration() ? read_calibration_report(report) : std::nullopt,
                             recipe.is_calibration() ? std::vector<std::string>() : read_remarks(report)};
  });
}

void ReconstructionThread::check(const Result<void>& done) {
  if (done) return;
  current_->error = done.error();
  if (current_->stop.stop_requested()) return;
  JobInfo choices{.folder = current_->folder};
  if (done.error().code == ErrorCode::ambiguous) take_choices(choices);
  post_event_(event::ReconstructionFailed{current_->job, done.error(), current_->quarantined, choices.choices});
}

void ReconstructionThread::tell_progress(std::string stage, double fraction) {
  // A hundred steps per stage are enough for any bar.
  if (stage == told_stage_ && fraction < 1.0 && std::abs(fraction - told_fraction_) < 0.01) return;
  told_stage_ = stage;
  told_fraction_ = fraction;
  post_event_(event::StageProgress{current_->job, std::move(stage), fraction});
}

}  // namespace scanrig
