#include "daemon/station/job_lifecycle.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "core/overloaded.h"

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

void set_model_ready(JobInfo& job, const event::ModelReady& e) {
  std::tie(job.state, job.model, job.report) = std::tuple(JobState::done, e.model, e.report);
  job.passed = !e.limit_violation;
  job.error = e.limit_violation;
  job.calibration = e.calibration;
  job.remarks = e.remarks;
}

void set_placement_dropped(JobInfo& job, const event::PlacementDropped& e) {
  const auto of_pose = [&](const auto& one) { return one.pose == e.pose; };
  std::erase_if(job.stored, of_pose);
  std::erase_if(job.movement_checks, of_pose);
  job.repeated = e.why.message;
  if (!is_final(job.state)) job.state = JobState::waiting_for_flip;
}

void set_images_checked(JobInfo& job, const event::ImagesChecked& e) {
  for (auto& view : job.stored) {
    if (view.pose == e.id.pose && view.view == e.id.view) view.problems = e.problems;
  }
}

void set_pose_stored(JobInfo& job, int pose) {
  const bool last = pose + 1 == job.recipe.poses;
  job.complete = pose + 1;
  job.state = last ? JobState::reconstructing : JobState::waiting_for_flip;
  if (last && job.error) job.state = JobState::failed;  // the reconstruction failed earlier
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
              if (is_final(job.state)) return;  // it was closed before the disk had let it start
              job.state = JobState::scanning;
              job.error.reset();
            });
          },
          [&](const event::JobUnreadable& e) {
            change(e.job, [&](JobInfo& job) {
              job.state = JobState::failed;
              job.error = e.why;
            });
          },
          [&](const event::MovementChecked& e) {
            change(e.job, [&](JobInfo& job) { job.movement_checks.push_back(e.movement_check); });
          },
          [&](const event::ViewStored& e) {
            change(e.id.job, [&](JobInfo& job) {
              if (!is_final(job.state)) job.state = JobState::scanning;
              job.repeated.clear();
              job.stored.push_back(
                  {e.id.pose, e.id.view, e.measured_deg, e.retake_reasons, e.commanded_deg, e.settling_ms});
              job.config_sha256 = e.config_sha256;
            });
          },
          [&](const event::PoseStored& e) { change(e.job, [&](JobInfo& job) { set_pose_stored(job, e.pose); }); },
          [&](const event::JobClosed& e) {
            change(e.job, [&](JobInfo& job) { std::tie(job.state, job.error) = std::tuple(e.state, e.why); });
          },
          [&](const event::StageProgress& e) { change(e.job, [&](JobInfo& job) { set_progress(job, e); }); },
          [&](const event::LiveMeshes& e) { change(e.job, [&](JobInfo& job) { job.live = e.names; }); },
          [&](const event::RestsSuggested& e) { change(e.job, [&](JobInfo& job) { job.suggestions = e.rests; }); },
          [&](const event::ReconstructionFailed& e) {
            change(e.job, [&](JobInfo& job) {
              job.error = e.error;
              job.quarantined = e.quarantined;
              if (!e.choices.empty()) job.choices = e.choices;
              if (job.state == JobState::reconstructing) job.state = JobState::failed;
            });
          },
          [&](const event::ModelReady& e) { change(e.job, [&](JobInfo& job) { set_model_ready(job, e); }); },
          [&](const event::ImagesChecked& e) { change(e.id.job, [&](JobInfo& job) { set_images_checked(job, e); }); },
          [&](const event::PlacementDropped& e) {
            change(e.job, [&](JobInfo& job) { set_placement_dropped(job, e); });
          },
          [](const auto&) {},  // concerns the machine only
      },
      event);
  return ended;
}

std::optional<JobEnd> close(JobTable& table, const action::CloseJob& task) {
  return change(table, task.job,
                [&](JobInfo& job) { std::tie(job.state, job.error) = std::tuple(task.state, task.why); });
}

bool is_resumable(const JobInfo& job) {
  if (job.recipe.is_calibration()) return job.state == JobState::interrupted;
  return job.state == JobState::interrupted && std::ranges::all_of(job.movement_checks, &MovementCheck::unmoved);
}

Error quarantine_error() {
  return {ErrorCode::internal,
          fmt::format("quarantined after {} crashes during reconstruction; send a bundle to support "
                      "or reprocess",
                      kAttemptsThatQuarantine)};
}

namespace {

/// Ends a scan that has all its views.
void set_scanned_state(JobInfo& job, const FolderFacts& facts) {
  if (!facts.has_report) {
    job.model = job.report = "";
    job.calibration.reset();
    job.remarks.clear();
  }
  job.quarantined = !facts.is_running && is_to_be_quarantined(facts.deaths);
  job.error = job.quarantined ? quarantine_error() : facts.failure;
  if (job.error) {
    job.state = job.error->code == ErrorCode::stopped ? JobState::cancelled : JobState::failed;
  } else if (!facts.has_report || facts.is_running) {
    job.state = JobState::reconstructing;
  } else {
    job.state = JobState::done;
    job.error = facts.limit_violation;
    job.passed = !job.error;
  }
}

}  // namespace

JobInfo with_state_of_folder(JobInfo job, const FolderFacts& facts) {
  if (facts.manifest_state == "scanned") {
    set_scanned_state(job, facts);
    return job;
  }
  job.model = job.report = "";
  job.calibration.reset();
  job.state = parse_job_state(facts.manifest_state).value_or(JobState::interrupted);
  if (job.state == JobState::queued) return job;
  if (job.state == JobState::scanning || job.state == JobState::waiting_for_flip) {
    job.state = JobState::interrupted;
    job.error = Error{ErrorCode::stopped, "the service ended during the scan"};
  } else {
    job.error = facts.failure.value_or(Error{ErrorCode::stopped, "the scan was " + facts.manifest_state});
  }
  return job;
}

}  // namespace scanrig
