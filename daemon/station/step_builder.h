#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "daemon/station/transition.h"

namespace scanrig {

/// What every rule of the station is made of: the state being changed, and the words for changing it.
class StepBuilder {
 public:
  StepBuilder(const StationState& state, const StationRules& rules) : rules_(rules) { step_.state = state; }

  bool is_active(const std::string& job) { return s().job && s().job->id == job; }
  Step take() && { return std::move(step_); }
  StationState& s() { return step_.state; }
  [[nodiscard]] const StationRules& rules() const { return rules_; }

  template <class SomeAction>
  void act(SomeAction action) {
    step_.actions.emplace_back(std::move(action));
  }
  template <class... Args>
  void refuse(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) {
    step_.refused = Error{code, fmt::format(text, std::forward<Args>(args)...)};
  }

  bool may_move();
  void enter(MachineState machine, std::string cause);
  void warn();
  void stop_rig();
  /// Stop to the drive, by a path that does not hang.
  void send_stop();
  void close_job(JobState state, Error why);

  /// Stops what moves; only Reset at the panel leaves the state.
  void fault(std::string cause, std::string device = {});
  /// The e-stop was pressed. A fault that came first stays the cause, and this is added to it.
  void estop(std::string_view what);
  /// What the rig was doing, for a sentence: "while the table was homing".
  std::string_view meanwhile();
  /// The same for a device that failed: safe at once, but it has its name only when an e-stop would have been seen,
  /// because an e-stop takes the power away from drives and adapters too.
  void fault_unclassified(const event::RigFailed& failure);
  void classify_fault();

  /// Why nothing may move now; null: it may.
  const char* unsafe();
  /// Refuses, and says why, unless e-stop and guard are known to be closed.
  bool require_safe();
  /// The same for whoever is not at the panel: he needs a guard between him and the table.
  bool remote_may_move(std::string_view what);
  /// Refuses, and says why, while the jobs' disk does not answer.
  bool require_disk();
  /// The first device that is known to be absent; null: all are there.
  const DeviceHealth* absent_device();
  /// Refuses, and says why, unless all devices are there. What is absent does not let a job begin.
  bool require_devices();
  /// Refuses, and says why, where the calibration is of other cameras than the rig's.
  bool require_calibration();
  /// Asks what is there now: devices, and the calibration for the next scan.
  void check();
  /// Homing, after the warning.
  void begin_homing(std::string cause);
  /// After a restart, where a closed guard stands for Reset.
  void auto_home_if_allowed();

 private:
  StationRules rules_;
  Step step_;
};

// maintenance.cpp
void ask_maintenance(StepBuilder& m, const event::MaintenanceRequested& asked);
void reset_in_maintenance(StepBuilder& m, Origin origin);
/// The warning is over: what was asked for begins.
void move_in_maintenance(StepBuilder& m);
/// A motion in maintenance has ended: consent lasts for a while from now.
void moved_in_maintenance(StepBuilder& m);
void consent_timed_out(StepBuilder& m);
/// Somebody may be at the table: whoever jogs next needs Reset at the panel.
void guard_opened_in_maintenance(StepBuilder& m);

// queue.cpp: which job has the rig next
void take_order(StepBuilder& m, const event::JobsOrdered& asked);
void ask_job(StepBuilder& m, const event::JobRequested& asked);
void job_updated(StepBuilder& m, const std::shared_ptr<const JobInfo>& info);
void job_removed(StepBuilder& m, const std::string& job);
/// The head of the queue gets the rig; where nothing is queued, a new job of the default recipe. Warns first.
void start_next_job(StepBuilder& m, const std::string& new_job_id, std::string cause);
void job_not_started(StepBuilder& m, const event::JobNotStarted& e);
void job_unreadable(StepBuilder& m, const event::JobUnreadable& e);
/// The rig is free again: ready, or on to the next part.
void release_rig(StepBuilder& m, std::string cause);
/// The outcome of a scan: once, and not of what is made of its images later.
void count_result(StepBuilder& m, const std::string& job, bool good);
void inputs_read(StepBuilder& m, const PanelInputs& inputs);
/// What the line's signals ask for, where every rule allows it; until then they wait. An object that was turned over is
/// scanned on, a new part on the table begins the next job of the queue.
void handle_part_signals(StepBuilder& m);

// scanning.cpp: the job that has the rig, view by view
void job_started(StepBuilder& m, const event::JobStarted& e);
void take_next_view(StepBuilder& m);
void view_taken(StepBuilder& m, const event::ViewTaken& e);
void view_stored(StepBuilder& m, const event::ViewStored& e);
void check_view_taken(StepBuilder& m, const event::CheckViewTaken& e);
void movement_checked(StepBuilder& m, const event::MovementChecked& e);
void pose_stored(StepBuilder& m, const event::PoseStored& e);
void store_failed(StepBuilder& m, const event::StoreFailed& e);
void disk_checked(StepBuilder& m, const event::DiskChecked& e);
/// There will be no model of the job that has the rig.
void model_given_up(StepBuilder& m, const Error& why);
/// The part was turned over.
void continue_after_flip(StepBuilder& m, std::string cause);
void flip_timed_out(StepBuilder& m, const event::FlipTimedOut& e);

}  // namespace scanrig
