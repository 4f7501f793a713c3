#include "daemon/station/job_table.h"

#include <algorithm>
#include <tuple>

#include "daemon/runtime/overloaded.h"

namespace scanrig {
namespace {

std::optional<JobEnd> replace(std::shared_ptr<const JobInfo>& job, std::shared_ptr<const JobInfo> with) {
  const bool ends = job && !is_final(job->state) && is_final(with->state);
  job = std::move(with);
  return ends ? std::optional(JobEnd{job->id, job->state}) : std::nullopt;
}

template <class Change>
std::optional<JobEnd> change(JobTable& table, const std::string& id, const Change& how) {
  const auto found = table.find(id);
  if (found == table.end()) return std::nullopt;
  auto job = std::make_shared<JobInfo>(*found->second);
  how(*job);
  return replace(found->second, std::move(job));
}

void set_progress(JobInfo& job, const event::StageProgress& e) {
  const auto stage = std::ranges::find(job.stages, e.stage, &StageShare::name);
  if (stage == job.stages.end()) {
    job.stages.push_back({e.stage, e.fraction});
  } else {
    stage->fraction = e.fraction;
  }
}

void set_pose_stored(JobInfo& job, int pose) {
  const bool last = pose + 1 == job.recipe.poses;
  job.complete = pose + 1;
  job.state = last ? JobState::reconstructing : JobState::waiting_for_flip;
  if (last && job.error) job.state = JobState::failed;  // the reconstruction gave up earlier
}

}  // namespace

std::optional<JobEnd> update(JobTable& table, const Event& event) {
  std::optional<JobEnd> ended;
  const auto change = [&](const std::string& id, const auto& how) { ended = scanrig::change(table, id, how); };
  std::visit(
      Overloaded{
          [&](const event::JobUpdated& e) { ended = replace(table[e.info->id], e.info); },
          [&](const event::JobRemoved& e) { table.erase(e.job); },
          [&](const event::JobStarted& e) {
            change(e.job, [](JobInfo& job) {
              if (is_final(job.state)) return;  // it was closed before the disk had let it begin
              job.state = JobState::scanning;
              job.resumable = false;
              job.error.reset();
            });
          },
          [&](const event::JobUnreadable& e) {
            change(e.job, [&](JobInfo& job) {
              job.state = JobState::failed;
              job.resumable = false;
              job.error = e.why;
            });
          },
          [&](const event::MovementChecked& e) {
            change(e.job, [&](JobInfo& job) { job.movement_checks.push_back(e.movement_check); });
          },
          [&](const event::ViewStored& e) {
            change(e.id.job, [&](JobInfo& job) {
              if (!is_final(job.state)) job.state = JobState::scanning;
              job.stored.push_back(
                  {e.id.pose, e.id.view, e.measured_deg, e.retake_reasons, e.commanded_deg, e.settling_ms});
              job.config_sha256 = e.config_sha256;
            });
          },
          [&](const event::PoseStored& e) { change(e.job, [&](JobInfo& job) { set_pose_stored(job, e.pose); }); },
          [&](const event::JobClosed& e) {
            change(e.job, [&](JobInfo& job) {
              std::tie(job.state, job.error, job.resumable) = std::tuple(e.state, e.why, e.resumable);
            });
          },
          [&](const event::StageProgress& e) { change(e.job, [&](JobInfo& job) { set_progress(job, e); }); },
          [&](const event::ReconstructionFailed& e) {
            change(e.job, [&](JobInfo& job) {
              job.error = e.error;
              job.quarantined = e.quarantined;
              if (job.state == JobState::reconstructing) job.state = JobState::failed;
            });
          },
          [&](const event::ModelReady& e) {
            change(e.job, [&](JobInfo& job) {
              std::tie(job.state, job.model, job.report) = std::tuple(JobState::done, e.model, e.report);
              job.passed = !e.limit_violation;
              job.error = e.limit_violation;
            });
          },
          [](const auto&) {},  // concerns the machine only
      },
      event);
  return ended;
}

std::optional<JobEnd> close(JobTable& table, const action::CloseJob& task) {
  return change(table, task.job, [&](JobInfo& job) {
    std::tie(job.state, job.error) = std::tuple(task.state, task.why);
    job.resumable =
        task.state == JobState::interrupted && std::ranges::all_of(job.movement_checks, &MovementCheck::unmoved);
  });
}

}  // namespace scanrig
