#include "daemon/jobs/job_thread.h"

#include <algorithm>
#include <system_error>
#include <tuple>
#include <utility>

#include "core/catch_exceptions.h"
#include "core/files.h"
#include "core/image_codec.h"
#include "core/overloaded.h"
#include "daemon/runtime/actor.h"
#include "daemon/station/job_lifecycle.h"
#include "pipeline/movement/turned_table.h"

namespace scanrig {
namespace {

/// A person looks first at images without a match: they are kept beside the views.
Result<void> keep_images(const ScanFolder& scan, int pose, std::size_t number, const RawView& again) {
  const auto folder = scan.path() / scan.manifest().poses[static_cast<std::size_t>(pose)].name;
  std::vector<FileContent> files;
  const auto left = encode_png(again.left_plain), right = encode_png(again.right_plain);
  if (!left) return pass_on(left);
  if (!right) return pass_on(right);
  files.push_back({fmt::format("movement{:02}_left.png", number), *left});
  files.push_back({fmt::format("movement{:02}_right.png", number), *right});
  return write_files_synced(folder, files);
}

/// Checks that the job has the calibration it is scanned with, and that this belongs to the rig's cameras.
Result<void> settle_calibration(const JobStore& store, const JobInfo& job) {
  if (job.recipe.is_calibration()) return {};
  if (!has_views(job)) {
    if (auto same = store.check_rig_cameras(); !same) return same;
    if (auto renewed = store.renew_calibration(job); !renewed) return renewed;
  }
  return store.check_job_cameras(job.id);
}

/// Limits for view 0 taken again. A rig that is calibrated for the first time has no calibration.
CompareViewsOptions limits_of(double turned_deg, bool left, const Result<Calibration>& rig) {
  return rig ? allowing_for(turned_deg, left ? rig->left : rig->right, *rig) : CompareViewsOptions{};
}

}  // namespace

JobThread::JobThread(Clock& clock, const JobStore& store, ReconstructionThread& reconstruction, ScannedHook on_scanned,
                     std::function<void(Event)> post_event)
    : store_(store),
      reconstruction_(reconstruction),
      on_scanned_(std::move(on_scanned)),
      post_event_(std::move(post_event)),
      inbox_(clock),
      busy_timer_(clock),
      thread_(start_actor(clock, [this] { run(); })) {}

JobThread::~JobThread() {
  inbox_.close();
  thread_.join();
}

void JobThread::run() {
  while (auto task = inbox_.take()) {
    busy_timer_.begins();
    const auto done = catch_exceptions("storing", [&]() -> Result<void> {
      std::visit([this](const auto& t) { handle(t); }, *task);
      return {};
    });
    if (!done) fail_task(*task, done.error());
    busy_timer_.ends();
  }
}

/// An exception ends as a failure does: the requester gets a reply, and the active job is interrupted.
void JobThread::fail_task(const Task& task, const Error& why) {
  const Result<void> failed = tl::unexpected(why);
  std::visit(Overloaded{[&](const action::CreateJobs& t) {
                          answer(t.request_id, failed, {});
                          post_event_(event::StoreFailed{t.ids.front(), why});
                        },
                        [](const LogLine&) {}, [&](const action::MoveJob& t) { answer(t.request_id, failed, {}); },
                        [&](const action::RunJobRequest& t) { answer(t.asked.request_id, failed, {}); },
                        [&](const action::CheckCalibration& t) {
                          post_event_(event::CalibrationChecked{t.job, std::nullopt});
                        },
                        [&](const action::StoreView& t) { give_up(t.view->id.job, why); },
                        [&](const action::CheckMovement& t) { give_up(t.view->id.job, why); },
                        [&](const action::CloseJob& t) {
                          scan_.reset();
                          post_event_(event::JobClosed{t.job, t.state, t.why});
                        },
                        [&](const auto& t) { give_up(t.job, why); }},
             task);
}

void JobThread::answer(RequestId request_id, const Result<void>& done, const std::string& result) {
  if (request_id == 0) return;
  if (done) return post_event_(event::RequestDone{request_id, result});
  post_event_(event::RequestDone{request_id, pass_on(done)});
}

void JobThread::tell_known(const std::string& job) {
  if (auto info = store_.read(job)) post_event_(event::JobUpdated{std::make_shared<const JobInfo>(std::move(*info))});
}

/// A disk that refuses this also refuses what the job needs, and that is reported.
void JobThread::handle(const LogLine& line) {
  std::ignore = append_job_log(store_.folder(line.entry.job), line.entry, line.when);
}

/// An unreadable calibration is named when a job is made.
void JobThread::handle(const action::CheckCalibration& task) {
  const auto same = task.job.empty() ? store_.check_rig_cameras() : store_.check_job_cameras(task.job);
  const bool refused = !same && same.error().code == ErrorCode::refused;
  post_event_(event::CalibrationChecked{task.job, refused ? std::optional(same.error()) : std::nullopt,
                                        store_.calibration_reminder()});
}

void JobThread::handle(const action::CreateJobs& task) {
  Result<void> done;
  auto place = task.place;
  for (const auto& id : task.ids) {
    busy_timer_.begins();
    auto job = store_.create(id, {.recipe = task.recipe, .part = task.part, .place = place++});
    if (!job) {
      done = pass_on(job);
      post_event_(event::StoreFailed{id, job.error().in("cannot begin the job")});
      break;
    }
    post_event_(event::JobUpdated{std::make_shared<const JobInfo>(std::move(*job))});
  }
  answer(task.request_id, done, task.ids.front());
}

void JobThread::handle(const action::StartJob& task) {
  const auto job = read_whole(task.job);
  if (!job) return set_aside(task.job, job.error());
  auto begun = store_.check_room(*job);
  if (begun) begun = settle_calibration(store_, *job);
  if (begun) begun = begin(*job);
  if (begun) return;
  post_event_(event::JobNotStarted{task.job, begun.error()});
  tell_known(task.job);
}

/// Checks what the scan will need: its calibration, and the view that is taken again before it continues.
Result<JobInfo> JobThread::read_whole(const std::string& id) const {
  auto job = store_.read(id);
  if (!job) return job;
  const auto scan = ScanFolder::open(job->folder);
  if (!scan) return pass_on(scan);
  const auto calibration = scan->load_calibration();
  if (!calibration && !job->recipe.is_calibration()) return pass_on(calibration);
  const auto pose = static_cast<std::size_t>(job->complete);
  const auto& poses = scan->manifest().poses;
  if (pose >= poses.size() || poses[pose].views.empty()) return job;
  if (const auto first = scan->load_raw(pose, 0); !first) return pass_on(first);
  return job;
}

/// Recorded where the folder still allows that. An unreadable folder is found failed at the next start too, and
/// a disk that does not respond now may do so then.
void JobThread::set_aside(const std::string& id, const Error& why) {
  auto scan = ScanFolder::open(store_.folder(id));
  if (scan && why.code != ErrorCode::io && scan->set_state("failed")) std::ignore = write_failure(scan->path(), why);
  post_event_(event::JobUnreadable{id, why});
  std::error_code ignored;
  if (!std::filesystem::exists(store_.folder(id), ignored)) post_event_(event::JobRemoved{id});
}

/// Continues where the manifest ends.
Result<void> JobThread::begin(const JobInfo& job) {
  auto scan = ScanFolder::open(job.folder);
  if (!scan) return pass_on(scan);
  const auto current = static_cast<std::size_t>(job.complete);
  const auto moved = [](const MovementCheck& check) { return !check.unmoved; };
  if (job.recipe.is_calibration() && std::ranges::any_of(job.movement_checks, moved)) {
    if (auto dropped = scan->drop_views(current, "scanning"); !dropped) return dropped;
    post_event_(event::PlacementDropped{job.id, job.complete, {ErrorCode::moved, "the board slipped"}});
  }
  if (auto state = scan->set_state("scanning"); !state) return state;
  // The daemon died in a scan without a recorded end. Its views may have been the reason, and are not examined again
  // beside the moving table.
  const bool may_be_reason = !job.stored.empty() && !read_failure(job.folder) && !job.recipe.is_calibration();
  later_ = may_be_reason ? std::optional(job.recipe) : std::nullopt;
  remove_failure(job.folder);
  scan_ = std::move(*scan);
  scan_->taken_under(store_.options().config_sha256);
  broken_ = false;
  if (!later_) reconstruction_.begin(job.id, *scan_, job.recipe);
  const auto& poses = scan_->manifest().poses;
  const int stored = current < poses.size() ? static_cast<int>(poses[current].views.size()) : 0;
  post_event_(event::JobStarted{job.id, job.complete, stored});
  return {};
}

/// Drops the views taken meanwhile, until the job is closed: a pose without one of its views could
/// never be completed.
void JobThread::give_up(const std::string& job, const Error& why) {
  broken_ = true;
  post_event_(event::StoreFailed{job, why});
}

void JobThread::handle(const action::StoreView& task) {
  const TakenView& view = *task.view;
  if (!storing()) return;  // the job could not start or continue, and that was reported
  const auto stored = scan_->add_view(static_cast<std::size_t>(view.id.pose), view.record, view.images);
  if (!stored) return give_up(view.id.job, stored.error());
  reconstruction_.add_view(task.view);
  post_event_(event::ViewStored{view.id, view.record.measured_deg, view.record.retake_reasons,
                                view.record.commanded_deg, view.record.settling_ms, scan_->manifest().config_sha256});
}

void JobThread::handle(const action::CheckMovement& task) {
  if (!storing()) return;
  const auto movement_check = judge(*task.view);
  if (!movement_check) return give_up(task.view->id.job, movement_check.error());
  post_event_(event::MovementChecked{task.view->id.job, *movement_check});
}

/// Compares the plain images with the first ones, and keeps the result as evidence.
Result<MovementCheck> JobThread::judge(const TakenView& again) {
  const auto pose = static_cast<std::size_t>(again.id.pose);
  const auto& record = scan_->manifest().poses[pose];
  const auto calibration = scan_->load_calibration();
  if (!calibration && scan_->manifest().source != "calibration") return pass_on(calibration);
  const double turned = again.record.measured_deg - record.views[0].measured_deg;
  const auto compare = [&](const char* role, bool is_left) -> Result<ViewChange> {
    const auto first = scan_->load_usable_image(pose, 0, role);
    if (!first) return pass_on(first);
    const auto now = to_usable_image(again.images.image(role), again.images.pixel_format);
    if (!now) return pass_on(now);
    return compare_views(*first, *now, limits_of(turned, is_left, calibration));
  };
  const auto left = compare("left_plain", true);
  if (!left) return pass_on(left);
  const auto right = compare("right_plain", false);
  if (!right) return pass_on(right);

  busy_timer_.begins();  // comparing takes time too
  const MovementCheck movement_check{again.id.pose, std::max(left->shift_px, right->shift_px),
                                     std::max(left->changed, right->changed), left->unmoved && right->unmoved,
                                     again.record.retake_reasons};
  if (!movement_check.unmoved) {
    if (auto kept = keep_images(*scan_, again.id.pose, record.movement_checks.size(), again.images); !kept) {
      return pass_on(kept);
    }
  }
  const auto added = scan_->add_movement_check(
      pose, {static_cast<int>(record.views.size()), again.record.measured_deg, again.record.taken,
             movement_check.shift_px, movement_check.changed, movement_check.unmoved, movement_check.retake_reasons});
  if (!added) return pass_on(added);
  return movement_check;
}

Result<void> JobThread::finish_pose(const action::FinishPose& task) {
  const auto pose = static_cast<std::size_t>(task.pose);
  if (auto done = scan_->complete_pose(pose, task.last ? "scanned" : "waiting_for_flip"); !done) return done;
  const bool is_scanned = task.last && scan_->manifest().source != "calibration";
  return is_scanned && on_scanned_ ? on_scanned_(scan_->path()) : Result<void>{};
}

void JobThread::handle(const action::FinishPose& task) {
  if (!storing()) return;
  const auto finished = finish_pose(task);
  if (!finished) return give_up(task.job, finished.error());
  post_event_(event::PoseStored{task.job, task.pose});
  reconstruction_.finish_pose(task.job, task.pose);
  if (task.last) {
    later_ ? reconstruction_.rebuild(task.job, scan_->path(), *later_, {}) : reconstruction_.finish(task.job);
    scan_.reset();
  }
}

void JobThread::handle(const action::CheckPlacement& task) {
  if (storing()) reconstruction_.check_placement(task.job, task.pose);
}

void JobThread::handle(const action::DropPlacement& task) {
  if (!storing()) return;
  const auto dropped = scan_->drop_views(static_cast<std::size_t>(task.pose), "waiting_for_flip");
  if (!dropped) return give_up(task.job, dropped.error());
  reconstruction_.drop_pose(task.job, task.pose);
  post_event_(event::PlacementDropped{task.job, task.pose, task.why});
}

void JobThread::handle(const action::ResumeJob& task) {
  if (!storing()) return;
  const auto state = scan_->set_state("scanning");
  if (!state) give_up(task.job, state.error());
}

void JobThread::handle(const action::CloseJob& task) {
  reconstruction_.abandon(task.job);
  if (!scan_) return tell_known(task.job);  // it did not start
  auto closed = scan_->set_state(std::string(to_string(task.state)));
  if (closed) closed = write_failure(scan_->path(), task.why);
  // On a full disk the job is found unfinished at the next start, and interrupted then.
  scan_.reset();
  post_event_(event::JobClosed{task.job, task.state, task.why});
}

}  // namespace scanrig
