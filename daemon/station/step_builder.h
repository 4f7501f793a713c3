#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "daemon/station/transition.h"

namespace scanrig {

/// Basis of every rule of the station: the state being changed, and the functions that change it.
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
  /// Stops the drive, by a path that does not hang.
  void send_stop();
  void close_job(JobState state, Error why);

  /// Stops what moves; only Reset at the panel leaves the state.
  void fault(std::string cause, std::string device = {});
  /// Handles a pressed e-stop. A fault that came first stays the cause, and this is added to it.
  void estop(std::string_view what);
  /// The rig's last activity, for a sentence: "while the table was homing".
  std::string_view meanwhile();
  /// The same for a failed device: safe at once. It gets its name only when an e-stop would have been read, because an
  /// e-stop takes the power away from drives and adapters too.
  void fault_unclassified(const event::RigFailed& failure);
  void classify_fault();

  /// Why nothing may move now; null: motion allowed.
  const char* unsafe();
  /// Refuses with a reason unless e-stop and guard are known to be closed.
  bool require_safe();
  /// The same for a requester away from the panel, who needs a guard between person and table.
  bool remote_may_move(std::string_view what);
  void refuse_lent() { refuse(ErrorCode::refused, "Setup has the devices: end it first."); }
  /// Refuses with a reason while the job disk does not respond.
  bool require_disk();
  /// The first device that is known to be absent; null: none is.
  const DeviceHealth* absent_device();
  /// Refuses with a reason unless all devices respond. An absent device does not let a job start.
  bool require_devices();
  /// Refuses with a reason where the calibration belongs to other cameras than the rig's.
  bool require_calibration();
  /// Requests a check of devices, and of the calibration for the next scan.
  void check();
  /// Homes, after the warning.
  void begin_homing(std::string cause);
  /// Homes after a restart, where a closed guard replaces Reset.
  void auto_home_if_allowed();

 private:
  StationRules rules_;
  Step step_;
};

// maintenance.cpp
void ask_maintenance(StepBuilder& m, const event::MaintenanceRequested& asked);
/// Restarts the daemon: under a new configuration, without devices while setup has them, or with them again.
void ask_restart(StepBuilder& m, const event::ReloadRequested& asked);
void reset_in_maintenance(StepBuilder& m, Origin origin);
/// Ends the warning: the requested action starts.
void move_in_maintenance(StepBuilder& m);
/// Ends a motion in maintenance: consent lasts for a while from now.
void moved_in_maintenance(StepBuilder& m);
void consent_timed_out(StepBuilder& m);
/// A person may be at the table: the next jog needs Reset at the panel.
void guard_opened_in_maintenance(StepBuilder& m);

// queue.cpp: which job becomes active next
void take_order(StepBuilder& m, const event::JobsOrdered& asked);
void ask_job(StepBuilder& m, const event::JobRequested& asked);
void job_updated(StepBuilder& m, const std::shared_ptr<const JobInfo>& info);
void job_removed(StepBuilder& m, const std::string& job);
/// Makes the head of the queue active; with an empty queue, a new job of the default recipe. Warns first.
void start_next_job(StepBuilder& m, const std::string& new_job_id, std::string cause);
void job_not_started(StepBuilder& m, const event::JobNotStarted& e);
void job_unreadable(StepBuilder& m, const event::JobUnreadable& e);
/// Frees the rig: ready, or on to the next part.
void release_rig(StepBuilder& m, std::string cause);
/// Counts the outcome of a scan: once, and not of later reconstructions of its images.
void count_result(StepBuilder& m, const std::string& job, bool good);
void inputs_read(StepBuilder& m, const PanelInputs& inputs);
/// Handles the automation's signals where every rule allows it; until then they wait. Continues the scan of an object
/// that was turned over. A new part on the table starts the next job of the queue.
void handle_part_signals(StepBuilder& m);

// scanning.cpp: the active job, view by view
void job_started(StepBuilder& m, const event::JobStarted& e);
void take_next_view(StepBuilder& m);
void view_taken(StepBuilder& m, const event::ViewTaken& e);
void view_stored(StepBuilder& m, const event::ViewStored& e);
void check_view_taken(StepBuilder& m, const event::CheckViewTaken& e);
void movement_checked(StepBuilder& m, const event::MovementChecked& e);
void pose_stored(StepBuilder& m, const event::PoseStored& e);
void store_failed(StepBuilder& m, const event::StoreFailed& e);
void disk_checked(StepBuilder& m, const event::DiskChecked& e);
/// Reports that the active job will have no model.
void model_given_up(StepBuilder& m, const Error& why);
// scanning.cpp: a calibration, placement by placement
void images_checked(StepBuilder& m, const event::ImagesChecked& e);
void placement_checked(StepBuilder& m, const event::PlacementChecked& e);
void placement_dropped(StepBuilder& m, const event::PlacementDropped& e);
void turned(StepBuilder& m);
/// Handles a part that was turned over, or a board that was put in place.
void continue_after_flip(StepBuilder& m, std::string cause);
void flip_timed_out(StepBuilder& m, const event::FlipTimedOut& e);

}  // namespace scanrig
