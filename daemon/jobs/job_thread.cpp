#include "daemon/jobs/job_thread.h"

#include <utility>

#include "daemon/actor_thread.h"

namespace scanrig {

JobThread::JobThread(Clock& clock, const JobStore& store, ReconstructionThread& reconstruction, ScannedHook on_scanned,
                     std::function<void(Event)> tell)
    : store_(store),
      reconstruction_(reconstruction),
      on_scanned_(std::move(on_scanned)),
      tell_(std::move(tell)),
      inbox_(clock),
      thread_(start_actor(clock, [this] { run(); })) {}

JobThread::~JobThread() {
  inbox_.close();
  thread_.join();
}

void JobThread::run() {
  while (auto task = inbox_.take()) {
    std::visit([this](const auto& t) { handle(t); }, *task);
  }
}

void JobThread::handle(const action::CreateJob& task) {
  auto scan = store_.create(task.job);
  if (!scan) return tell_(event::StoreFailed{task.job, scan.error().in("cannot begin the job")});
  scan_ = std::move(*scan);
  reconstruction_.begin(task.job, scan_->path());
  tell_(event::JobCreated{task.job, scan_->path()});
}

void JobThread::handle(const action::StoreView& task) {
  const TakenView& view = *task.view;
  if (!scan_) return;  // the job could not be begun, and that was told
  const auto stored = scan_->add_view(static_cast<std::size_t>(view.id.pose), view.record, view.images);
  if (!stored) return tell_(event::StoreFailed{view.id.job, stored.error()});
  reconstruction_.add_view(task.view);
  tell_(event::ViewStored{view.id, view.record.measured_deg, view.redone, view.record.commanded_deg,
                          view.record.settling_ms});
}

Result<void> JobThread::finish_pose(const action::FinishPose& task) {
  if (auto complete = scan_->set_pose_complete(static_cast<std::size_t>(task.pose)); !complete) return complete;
  if (auto state = scan_->set_state(task.last ? "scanned" : "waiting_for_flip"); !state) return state;
  return task.last && on_scanned_ ? on_scanned_(scan_->path()) : Result<void>{};
}

void JobThread::handle(const action::FinishPose& task) {
  if (!scan_) return;
  const auto finished = finish_pose(task);
  if (!finished) return tell_(event::StoreFailed{task.job, finished.error()});
  tell_(event::PoseStored{task.job, task.pose});
  reconstruction_.finish_pose(task.job, task.pose);
  if (task.last) {
    reconstruction_.finish(task.job);
    scan_.reset();
  }
}

void JobThread::handle(const action::ResumeJob& task) {
  if (!scan_) return;
  const auto state = scan_->set_state("scanning");
  if (!state) tell_(event::StoreFailed{task.job, state.error()});
}

void JobThread::handle(const action::CloseJob& task) {
  reconstruction_.abandon(task.job);
  if (scan_) {
    auto closed = scan_->set_state(std::string(to_string(task.state)));
    if (closed) closed = write_failure(scan_->path(), task.why);
    // On a disk that takes nothing more the job is found unfinished at the next start, and interrupted then.
    scan_.reset();
  }
  tell_(event::JobClosed{task.job, task.state, task.why});
}

}  // namespace scanrig
