#include "daemon/station/step_builder.h"

namespace scanrig {
namespace {

constexpr int kMaxUnstored = 2;  ///< views in memory only; a power cut costs no more

void finish_pose(StepBuilder& m) {
  const auto& job = *m.s().job;
  m.s().activity = Activity::storing;
  m.act(action::FinishPose{job.id, job.pose, job.pose + 1 == job.recipe.poses});
}

/// The next placement's mark faces the cameras, so that they show how the board is put down. It was the Start of this
/// placement that let the table move.
void turn_to_mark(StepBuilder& m) {
  auto& job = *m.s().job;
  const Degrees angle{facing_deg(job.recipe.placement(next_pose(job)))};
  job.turning = true;
  m.s().activity = Activity::scanning;
  m.s().table_deg = angle.value;
  m.act(action::TurnTo{angle});
}

void wait_for_person(StepBuilder& m) {
  auto& s = m.s();
  s.activity = Activity::waiting_for_flip;
  m.act(action::WaitForFlip{s.job->id, s.job->recipe.flip_timeout});
}

/// The board has slipped, or too few of its images are good: only this placement is taken again.
void drop_placement(StepBuilder& m, Error why) {
  const auto& job = *m.s().job;
  m.s().activity = Activity::storing;
  m.act(action::DropPlacement{job.id, job.pose, std::move(why)});
}

/// The views of this pose do not belong together: no model can come of them.
void moved(StepBuilder& m, const MovementCheck& movement_check) {
  const auto& job = *m.s().job;
  if (job.recipe.is_calibration()) {
    return drop_placement(m, {ErrorCode::moved, fmt::format("the board slipped in placement {}", job.pose + 1)});
  }
  const bool resuming = job.taken < job.recipe.views_of(job.pose);
  const Error why{
      ErrorCode::moved,
      fmt::format("something moved in pose {} ({} px, {:.0f} % of the image changed); scan the part again",
                  job.pose + 1,
                  movement_check.shift_px > 1.0 ? "more than 1" : fmt::format("{:.2f}", movement_check.shift_px),
                  100 * movement_check.changed)};
  const std::string cause = fmt::format("Job {}: {}.", job.id, why.message);
  if (!resuming) count_result(m, job.id, false);
  m.close_job(resuming ? JobState::interrupted : JobState::failed, why);
  release_rig(m, cause);
}

/// Reports that turning the object over is useless.
void fail_before_flip(StepBuilder& m) {
  const auto job = *m.s().job;
  m.close_job(JobState::failed, *job.reconstruction);
  release_rig(m, fmt::format("Job {} failed.", job.id));
}

/// A full disk is no fault of the rig: what moves is stopped, as by Stop, and nothing latches. What
/// is stored remains, and with free space the job can be resumed.
void interrupt(StepBuilder& m, const Error& why, const char* then) {
  const auto id = m.s().job->id;
  const bool begun = m.s().job->is_started;
  m.close_job(JobState::interrupted, why);
  if (m.s().machine == MachineState::error) return;  // a fault came first and keeps its message
  auto cause =
      fmt::format("Job {} {}: {}{}.", id, begun ? "is interrupted" : "did not start", why.message, begun ? then : "");
  if (m.s().activity != Activity::scanning) return m.enter(MachineState::ready, std::move(cause));  // nothing moves
  m.s().machine = MachineState::halted;
  m.s().auto_home_allowed = false;
  m.s().cause = std::move(cause);
  m.stop_rig();
}

}  // namespace

void job_started(StepBuilder& m, const event::JobStarted& e) {
  if (!m.is_active(e.job)) return;
  auto& job = *m.s().job;
  m.s().disk_trouble = false;
  job.is_started = true;
  job.pose = e.pose;
  job.asked = job.taken = job.stored = e.stored;
  job.movement_check_due = e.stored > 0;  // is the object still where the stored views saw it?
  take_next_view(m);
}

void take_next_view(StepBuilder& m) {
  if (m.s().activity != Activity::scanning || !m.s().job->is_started) return;
  auto& job = *m.s().job;
  const auto take = [&](int view, bool again) {
    const double angle = job.recipe.angles_deg(job.pose)[static_cast<std::size_t>(view)];
    m.s().table_deg = angle;
    m.act(action::TakeView{{job.id, job.pose, view}, {angle}, again, job.recipe.is_calibration()});
  };
  if (job.closing || job.asked > job.taken || job.taken - job.stored >= kMaxUnstored) return;
  if (job.movement_check_due) {
    job.movement_check_due = false;
    job.closing = true;
    return take(0, true);
  }
  if (job.asked == job.recipe.views_of(job.pose)) return;
  take(job.asked, false);
  ++job.asked;
}

void view_taken(StepBuilder& m, const event::ViewTaken& e) {
  if (m.s().activity != Activity::scanning) return;  // a view that came after Stop is not kept
  auto& job = *m.s().job;
  if (job.taken == job.asked) return;
  ++job.taken;
  m.act(action::StoreView{e.view});
  job.movement_check_due = job.taken == job.recipe.views_of(job.pose);
  take_next_view(m);
}

void view_stored(StepBuilder& m, const event::ViewStored& e) {
  if (!m.is_active(e.id.job) || e.id.pose != m.s().job->pose || m.s().job->stored == m.s().job->taken) return;
  ++m.s().job->stored;
  take_next_view(m);
}

void check_view_taken(StepBuilder& m, const event::CheckViewTaken& e) {
  if (m.s().activity != Activity::scanning) return;
  const auto& job = *m.s().job;
  if (job.taken == job.recipe.views_of(job.pose)) m.s().activity = Activity::storing;
  m.act(action::CheckMovement{e.view});
}

void movement_checked(StepBuilder& m, const event::MovementChecked& e) {
  const bool executing = m.s().activity == Activity::scanning || m.s().activity == Activity::storing;
  if (!m.is_active(e.job) || !m.s().job->closing || !executing) return;
  m.s().job->closing = false;
  if (!e.movement_check.unmoved) return moved(m, e.movement_check);
  const auto& job = *m.s().job;
  if (job.stored < job.recipe.views_of(job.pose)) return take_next_view(m);
  if (!job.recipe.is_calibration()) return finish_pose(m);
  m.s().activity = Activity::storing;
  m.act(action::CheckPlacement{job.id, job.pose});
}

void pose_stored(StepBuilder& m, const event::PoseStored& e) {
  auto& s = m.s();
  if (!m.is_active(e.job) || s.activity != Activity::storing || e.pose != s.job->pose) return;
  if (e.pose + 1 == s.job->recipe.poses) {
    s.job.reset();
    release_rig(m, fmt::format("Job {} has all its views.", e.job));
  } else if (s.job->reconstruction) {
    fail_before_flip(m);
  } else {
    const bool calibrates = s.job->recipe.is_calibration();
    s.cause = fmt::format("{} {} is complete.", calibrates ? "Placement" : "Pose", e.pose + 1);
    calibrates ? turn_to_mark(m) : wait_for_person(m);
  }
}

/// A pose is always scanned to its end.
void model_given_up(StepBuilder& m, const Error& why) {
  m.s().job->reconstruction = why;
  if (m.s().activity == Activity::waiting_for_flip) fail_before_flip(m);
}

void images_checked(StepBuilder& m, const event::ImagesChecked& e) {
  if (!m.is_active(e.id.job) || e.id.pose != m.s().job->pose || e.problems.empty()) return;
  m.s().job->image_problem = fmt::format("View {}, {}", e.id.view + 1, e.problems.front());
}

void placement_checked(StepBuilder& m, const event::PlacementChecked& e) {
  const auto& s = m.s();
  if (!m.is_active(e.job) || s.activity != Activity::storing || e.pose != s.job->pose || s.job->closing) return;
  if (s.job->stored < s.job->recipe.views_of(e.pose)) return;
  e.problem ? drop_placement(m, *e.problem) : finish_pose(m);
}

void placement_dropped(StepBuilder& m, const event::PlacementDropped& e) {
  auto& s = m.s();
  if (!m.is_active(e.job) || s.activity != Activity::storing || e.pose != s.job->pose) return;
  s.job->asked = s.job->taken = s.job->stored = 0;
  s.job->repeated = e.why.message;
  s.cause = fmt::format("Placement {} is taken again: {}.", e.pose + 1, e.why.message);
  if (s.job->reconstruction) return fail_before_flip(m);
  turn_to_mark(m);
}

void turned(StepBuilder& m) {
  auto& s = m.s();
  if (s.activity != Activity::scanning || !s.job || !s.job->turning) return;
  s.job->turning = false;
  s.job->reconstruction ? fail_before_flip(m) : wait_for_person(m);
}

void continue_after_flip(StepBuilder& m, std::string cause) {
  auto& job = *m.s().job;
  job.pose = next_pose(job);
  job.repeated.clear();
  job.image_problem.clear();
  job.asked = job.taken = job.stored = 0;
  job.turned_over = false;
  m.s().cause = std::move(cause);
  m.act(action::ResumeJob{job.id});
  m.warn();
}

void store_failed(StepBuilder& m, const event::StoreFailed& e) {
  if (!m.is_active(e.job)) return;
  const bool disk = e.error.code == ErrorCode::io;
  m.s().disk_trouble = disk;
  if (!m.s().job->is_started) m.s().not_started = {e.job, e.error};
  interrupt(m, e.error, disk ? "; check the disk, then resume the job" : "");
}

/// The active job waits for the disk sooner or later: end it with the disk's name, not with a time-out elsewhere.
void disk_checked(StepBuilder& m, const event::DiskChecked& e) {
  m.s().disk_problem = e.problem;
  if (!e.problem) return handle_part_signals(m);
  m.s().disk_trouble = true;
  if (m.s().job) interrupt(m, *e.problem, ", then resume the job");
}

void flip_timed_out(StepBuilder& m, const event::FlipTimedOut& e) {
  if (!m.is_active(e.job) || m.s().activity != Activity::waiting_for_flip) return;
  const auto limit = m.s().job->recipe.flip_timeout;
  const char* const not_done = m.s().job->recipe.is_calibration() ? "board not put in place" : "part not turned over";
  count_result(m, e.job, false);
  m.close_job(JobState::interrupted,
              {ErrorCode::timeout, fmt::format("parked: {} in {} min; resume the job", not_done, limit.count())});
  release_rig(m, fmt::format("Job {} is parked: {} in time.", e.job, not_done));
}

}  // namespace scanrig
