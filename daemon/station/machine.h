#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "daemon/station/transition.h"

namespace scanrig {

/// What every rule of the station is made of: the state being changed, and the words for changing it.
class Machine {
 public:
  Machine(const StationState& state, const StationRules& rules) : rules_(rules) { step_.state = state; }

  bool has(const std::string& job) { return s().job && s().job->id == job; }
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
  void close_job(JobState state, Error why);

  /// Stops what moves; only Reset at the panel leaves the state.
  void fault(std::string cause, std::string device = {});
  /// The same for a device that failed: safe at once, but it has its name only when an e-stop would have been seen,
  /// because an e-stop takes the power away from drives and adapters too.
  void fault_unnamed(const event::RigFailed& failure);
  void name_fault();

  /// Why nothing may move now; null: it may.
  const char* unsafe();
  /// Refuses, and says why, unless e-stop and guard are known to be closed.
  bool safe_to_move();
  /// The same for whoever is not at the panel: he needs a guard between him and the table.
  bool remote_may_move(std::string_view what);
  /// Refuses, and says why, while the jobs' disk does not answer.
  bool disk_answers();
  /// The first device that is known to be absent; null: all are there.
  const DeviceHealth* absent_device();
  /// Refuses, and says why, unless all devices are there. What is absent does not let a job begin.
  bool all_there();
  /// Refuses, and says why, where the calibration is of other cameras than the rig's.
  bool calibrated();
  /// Asks what is there now: devices, and the calibration for the next scan.
  void check();
  /// Homing, after the warning.
  void begin_homing(std::string cause);
  /// After a restart, where a closed guard stands for Reset.
  void home_if_guarded();

 private:
  StationRules rules_;
  Step step_;
};

// maintenance.cpp
void ask_maintenance(Machine& m, const event::MaintenanceAsked& asked);
void reset_in_maintenance(Machine& m, Origin origin);
void stop_in_maintenance(Machine& m);
/// The warning is over: what was asked for begins.
void move_in_maintenance(Machine& m);

// queue.cpp: which job has the rig next
void take_order(Machine& m, const event::Ordered& asked);
void ask_job(Machine& m, const event::JobAsked& asked);
void job_known(Machine& m, const std::shared_ptr<const JobInfo>& info);
void job_removed(Machine& m, const std::string& job);
/// The head of the queue gets the rig; where nothing is queued, a new job of the default recipe. Warns first.
void begin_next_job(Machine& m, const std::string& fresh_job_id, std::string cause);
void job_not_begun(Machine& m, const event::JobNotBegun& e);
void job_unreadable(Machine& m, const event::JobUnreadable& e);
/// The rig is free again: ready, or on to the next part.
void free_rig(Machine& m, std::string cause);
/// The outcome of a scan: once, and not of what is made of its images later.
void count_result(Machine& m, const std::string& job, bool good);
void inputs_seen(Machine& m, const PanelInputs& inputs);
/// What the line's signals ask for, where every rule allows it; until then they wait. An object that was turned over is
/// scanned on, a new part on the table begins the next job of the queue.
void serve_line(Machine& m);

// scanning.cpp: the job that has the rig, view by view
void job_begun(Machine& m, const event::JobBegun& e);
void take_next_view(Machine& m);
void view_taken(Machine& m, const event::ViewTaken& e);
void view_stored(Machine& m, const event::ViewStored& e);
void closure_taken(Machine& m, const event::ClosureTaken& e);
void closure_judged(Machine& m, const event::ClosureJudged& e);
void pose_stored(Machine& m, const event::PoseStored& e);
void store_failed(Machine& m, const event::StoreFailed& e);
void disk_seen(Machine& m, const event::DiskSeen& e);
/// There will be no model of the job that has the rig.
void model_given_up(Machine& m, const Error& why);
/// The object was turned over.
void continue_after_flip(Machine& m, std::string cause);
void flip_timed_out(Machine& m, const event::FlipTimedOut& e);

}  // namespace scanrig
