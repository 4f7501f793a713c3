#include "daemon/station/job_table.h"

#include <algorithm>

namespace scanrig {
namespace {

template <class Change>
void change(JobTable& table, const std::string& id, const Change& how) {
  const auto found = table.find(id);
  if (found == table.end()) return;
  auto job = std::make_shared<JobInfo>(*found->second);
  how(*job);
  found->second = std::move(job);
}

void set_progress(JobInfo& job, const event::StageProgress& e) {
  const auto stage = std::ranges::find(job.stages, e.stage, &StageShare::name);
  if (stage == job.stages.end()) {
    job.stages.push_back({e.stage, e.fraction});
  } else {
    stage->fraction = e.fraction;
  }
}

}  // namespace

void update(JobTable& table, const Event& event, int poses, int views) {
  if (const auto* e = std::get_if<event::JobCreated>(&event)) {
    table[e->job] = std::make_shared<JobInfo>(
        JobInfo{.id = e->job, .folder = e->folder, .state = JobState::scanning, .poses = poses, .views = views});
  } else if (const auto* e = std::get_if<event::ViewStored>(&event)) {
    change(table, e->id.job, [&](JobInfo& job) {
      job.state = JobState::scanning;
      job.stored.push_back({e->id.pose, e->id.view, e->measured_deg, e->redone});
    });
  } else if (const auto* e = std::get_if<event::PoseStored>(&event)) {
    change(table, e->job, [&](JobInfo& job) {
      const bool last = e->pose + 1 == poses;
      job.state = last ? JobState::reconstructing : JobState::waiting_for_flip;
      if (last && job.error) job.state = JobState::failed;  // the reconstruction gave up earlier
    });
  } else if (const auto* e = std::get_if<event::JobClosed>(&event)) {
    change(table, e->job, [&](JobInfo& job) {
      job.state = e->state;
      job.error = e->why;
    });
  } else if (const auto* e = std::get_if<event::StageProgress>(&event)) {
    change(table, e->job, [&](JobInfo& job) { set_progress(job, *e); });
  } else if (const auto* e = std::get_if<event::ReconstructionFailed>(&event)) {
    change(table, e->job, [&](JobInfo& job) {
      job.error = e->error;
      if (job.state == JobState::reconstructing) job.state = JobState::failed;
    });
  } else if (const auto* e = std::get_if<event::ModelReady>(&event)) {
    change(table, e->job, [&](JobInfo& job) {
      job.state = JobState::done;
      job.model = e->model;
      job.report = e->report;
    });
  }
}

}  // namespace scanrig
