#include <system_error>
#include <utility>

#include "core/max_poses.h"
#include "daemon/jobs/job_thread.h"
#include "daemon/station/job_lifecycle.h"
#include "pipeline/storage/pose_choices.h"

/// What is asked of jobs that are not active; job_thread.cpp stores those that are.
namespace scanrig {
namespace {

using What = event::JobRequested::What;
using How = action::MoveJob::How;

Result<void> is_reconstructed(const std::string& job) {
  return fail(ErrorCode::busy, "job {} is being reconstructed: wait for its end, or cancel it", job);
}

const Error kCancelled{ErrorCode::stopped, "cancelled on request"};

}  // namespace

void JobThread::handle(const action::MoveJob& task) { answer(task.request_id, move(task), task.job); }

Result<void> JobThread::move(const action::MoveJob& task) {
  auto job = store_.read(task.job);
  if (!job) return pass_on(job);
  if (task.how == How::one_more) {
    if (reconstruction_.has(task.job)) return is_reconstructed(task.job);
    job = without_failed_pose(std::move(*job));
    return job ? add_pose(*job, task.place) : pass_on(job);
  }
  const bool resumes = task.how == How::resumed;
  if (resumes && !is_resumable(*job)) {
    return fail(ErrorCode::refused, "job {} is {} and cannot be resumed: order a new one", task.job,
                to_string(job->state));
  }
  if (resumes && has_views(*job) && !job->recipe.is_calibration()) {
    if (auto same = store_.check_job_cameras(task.job); !same) return same;
  }
  auto order = read_job_file(job->folder);
  if (!order) return pass_on(order);
  order->place = task.place;
  if (auto written = write_job_file(job->folder, *order); !written) return written;
  if (resumes) {
    auto scan = ScanFolder::open(job->folder);
    if (!scan) return pass_on(scan);
    if (auto queued = scan->set_state("queued"); !queued) return queued;
  }
  tell_known(task.job);
  return {};
}

/// Its views stay as they are, and so does its model until the new one is there. The part that lies on the table next
/// is this job's only if a person says so with Start, not an automation.
Result<void> JobThread::add_pose(const JobInfo& job, std::int64_t place) {
  if (job.recipe.is_calibration())
    return fail(ErrorCode::refused, "job {} is a calibration: only scans have poses", job.id);
  const bool is_whole = (job.state == JobState::done || job.state == JobState::failed) && !job.quarantined &&
                        job.complete == job.recipe.poses;
  if (!is_whole) {
    return fail(ErrorCode::refused, "job {} is {} with {} of {} poses: only a finished scan can be given another pose",
                job.id, job.quarantined ? "quarantined" : to_string(job.state), job.complete, job.recipe.poses);
  }
  if (job.complete >= static_cast<int>(kMaxPoses)) {
    return fail(ErrorCode::refused, "job {} has {} poses: no scan has more", job.id, kMaxPoses);
  }
  if (auto same = store_.check_job_cameras(job.id); !same) return same;
  auto order = read_job_file(job.folder);
  if (!order) return pass_on(order);
  order->whole_poses = job.complete;
  order->recipe.poses = job.complete + 1;
  order->recipe.start_on_part = false;
  order->exported = false;
  order->place = place;
  if (auto written = write_job_file(job.folder, *order); !written) return written;
  auto scan = ScanFolder::open(job.folder);
  if (!scan) return pass_on(scan);
  if (auto queued = scan->set_state("queued"); !queued) return queued;
  tell_known(job.id);
  return {};
}

/// Where something moved in the pose that was added, the scan without that pose.
Result<JobInfo> JobThread::without_failed_pose(JobInfo job) {
  if (job.state != JobState::failed || job.complete == job.recipe.poses) return job;
  auto order = read_job_file(job.folder);
  if (!order) return pass_on(order);
  if (order->whole_poses == 0 || order->whole_poses != job.complete) return job;
  if (auto taken = take_pose_back(job, std::move(*order)); !taken) return pass_on(taken);
  return store_.read(job.id);
}

/// The pose that was to be added is given up: the scan is whole, as it was.
Result<void> JobThread::take_pose_back(const JobInfo& job, JobFile order) {
  auto scan = ScanFolder::open(job.folder);
  if (!scan) return pass_on(scan);
  const bool has_begun = static_cast<int>(scan->manifest().poses.size()) > order.whole_poses;
  if (auto done = has_begun ? scan->drop_pose("scanned") : scan->set_state("scanned"); !done) return done;
  order.recipe.poses = std::exchange(order.whole_poses, 0);
  if (auto written = write_job_file(job.folder, order); !written) return written;
  std::error_code ignored;
  if (std::filesystem::exists(report_file(job.folder), ignored)) {
    remove_failure(job.folder);  // of the pose; the model is there
  } else if (!read_failure(job.folder)) {
    if (auto noted = write_failure(job.folder, kCancelled); !noted) return noted;
  }
  tell_known(job.id);
  return {};
}

void JobThread::handle(const action::RunJobRequest& task) {
  answer(task.asked.request_id, keep(task.asked), task.asked.job);
}

Result<void> JobThread::keep(const event::JobRequested& asked) {
  auto job = store_.read(asked.job);
  if (!job) return pass_on(job);
  if (asked.what == What::cancel) return cancel(*job);
  if (job->state == JobState::reconstructing || reconstruction_.has(asked.job)) {
    return is_reconstructed(asked.job);
  }
  if (asked.what == What::reprocess || asked.what == What::choose) {
    job = without_failed_pose(std::move(*job));
    if (!job) return pass_on(job);
    return asked.what == What::choose ? choose(std::move(*job), asked) : reprocess(std::move(*job), asked);
  }
  auto order = read_job_file(job->folder);
  if (!order) return pass_on(order);
  if (asked.what == What::accept) {
    auto accepted = store_.accept_calibration(*job);
    if (accepted) tell_known(asked.job);
    return accepted;
  }
  order->exported = true;
  if (auto written = write_job_file(job->folder, *order); !written) return written;
  tell_known(asked.job);
  return {};
}

/// Its evidence stays, and a scan with all its views can be reconstructed later.
Result<void> JobThread::cancel(const JobInfo& job) {
  if (job.state == JobState::queued || job.state == JobState::interrupted) {
    auto order = read_job_file(job.folder);
    if (!order) return pass_on(order);
    if (order->whole_poses > 0 && job.complete == order->whole_poses) return take_pose_back(job, std::move(*order));
    auto scan = ScanFolder::open(job.folder);
    if (!scan) return pass_on(scan);
    if (auto ended = scan->set_state("cancelled"); !ended) return ended;
  } else if (!reconstruction_.cancel(job.id)) {
    return fail(ErrorCode::refused,
                "job {} is {}: only what is queued, interrupted or being reconstructed can be cancelled", job.id,
                to_string(job.state));
  }
  if (auto noted = write_failure(job.folder, kCancelled); !noted) {
    // No thread works on it any more, and no other thread reports that.
    if (job.state != JobState::reconstructing) tell_known(job.id);
    if (job.state == JobState::reconstructing) post_event_(event::ReconstructionFailed{job.id, noted.error()});
    return noted;
  }
  tell_known(job.id);
  return {};
}

/// It lies in the job's folder from then on, so that a model that is made later is of the same choice.
Result<void> JobThread::choose(JobInfo job, const event::JobRequested& asked) {
  if (job.choices.empty() || job.complete != job.recipe.poses) {
    return fail(ErrorCode::refused, "job {} has nothing to choose: its poses do not fit in several ways", job.id);
  }
  if (auto picked = pick_choice(job.folder, asked.number); !picked) return picked;
  job.picked = asked.number;
  return reprocess(std::move(job), asked);
}

/// The images are all it needs; an older model stays until the new one is complete.
Result<void> JobThread::reprocess(JobInfo job, const event::JobRequested& asked) {
  if (job.complete < job.recipe.poses) {
    return fail(ErrorCode::refused, "job {} has only {} of {} poses: there is nothing to make a model of", asked.job,
                job.complete, job.recipe.poses);
  }
  forget_attempts(job.folder);
  remove_failure(job.folder);
  job.state = JobState::reconstructing;
  job.quarantined = false;
  job.error.reset();
  job.passed.reset();
  if (job.calibration) {  // one that is solved again is another one
    if (auto anew = set_accepted(job.folder, false); !anew) return anew;
    job.calibration.reset();
  }
  const auto known = std::make_shared<const JobInfo>(std::move(job));
  post_event_(event::JobUpdated{known});  // before any report of the reconstruction
  reconstruction_.rebuild(known->id, known->folder, known->recipe, {asked.voxel_mm, asked.fusion});
  return {};
}

}  // namespace scanrig
