#include "daemon/jobs/reconstruction_thread.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <system_error>
#include <utility>

#include "daemon/actor_thread.h"
#include "daemon/jobs/job_store.h"

namespace scanrig {

ReconstructionThread::ReconstructionThread(Clock& clock, ReconstructorFactory factory, int poses, int views,
                                           std::function<void(Event)> tell)
    : factory_(std::move(factory)),
      poses_(poses),
      views_(views),
      tell_(std::move(tell)),
      inbox_(clock),
      thread_(start_actor(clock, [this] { run(); })) {}

ReconstructionThread::~ReconstructionThread() {
  stop_.request_stop();
  inbox_.close();
  thread_.join();
}

void ReconstructionThread::run() {
  // Linux: of this thread and of the workers it will start. Without the right to be nice it works all the same.
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 10);
  while (auto message = inbox_.take()) {
    if (stop_.stop_requested()) continue;
    std::visit([this](const auto& m) { handle(m); }, *message);
  }
}

void ReconstructionThread::handle(const Begin& message) {
  current_ = Current{.job = message.job, .folder = message.folder};
  told_stage_.clear();
  const auto scan = ScanFolder::open(message.folder);
  if (!scan) return check(pass_on(scan));
  const auto calibration = scan->load_calibration();
  if (!calibration) return check(pass_on(calibration));
  current_->reconstructor = factory_(*calibration, scan->manifest());
}

void ReconstructionThread::handle(const AddView& message) {
  const TakenView& view = *message.view;
  if (!works_on(view.id.job)) return;
  const auto images = to_view_images(view.images, view.record);
  if (!images) return check(pass_on(images));
  // One stage for all views of the scan: the bar of the time in which the table turns.
  const auto progress = [this](std::string_view, double fraction) {
    tell_progress("range", (current_->views_done + fraction) / (poses_ * views_));
  };
  check(current_->reconstructor->add_view(static_cast<std::size_t>(view.id.pose), *images, context(progress)));
  ++current_->views_done;
  progress("range", 0.0);
}

void ReconstructionThread::handle(const FinishPose& message) {
  if (!works_on(message.job)) return;
  const auto progress = [&](std::string_view stage, double fraction) {
    tell_progress(fmt::format("{} pose {}", stage, message.pose + 1), fraction);
  };
  check(current_->reconstructor->finish_pose(static_cast<std::size_t>(message.pose), context(progress)));
}

void ReconstructionThread::handle(const Finish& message) {
  if (!current_ || current_->job != message.job) return;
  if (!current_->error) check(make_model());
  if (!current_->error) {
    tell_(event::ModelReady{current_->job, model_file(current_->folder), report_file(current_->folder)});
  } else if (!stop_.stop_requested()) {
    // A note that cannot be written costs the reason after a restart, nothing else.
    std::ignore = write_failure(current_->folder, *current_->error);
  }
  current_.reset();
}

void ReconstructionThread::handle(const Abandon& message) {
  if (current_ && current_->job == message.job) current_.reset();
}

Result<void> ReconstructionThread::make_model() {
  const auto progress = [this](std::string_view stage, double fraction) {
    tell_progress(std::string(stage), fraction);
  };
  return current_->reconstructor->finish(model_folder(current_->folder), context(progress));
}

void ReconstructionThread::check(const Result<void>& done) {
  if (done) return;
  current_->error = done.error();
  if (!stop_.stop_requested()) tell_(event::ReconstructionFailed{current_->job, done.error()});
}

void ReconstructionThread::tell_progress(std::string stage, double fraction) {
  // A hundred steps a stage are enough for any bar.
  if (stage == told_stage_ && fraction < 1.0 && std::abs(fraction - told_fraction_) < 0.01) return;
  told_stage_ = stage;
  told_fraction_ = fraction;
  tell_(event::StageProgress{current_->job, std::move(stage), fraction});
}

}  // namespace scanrig
