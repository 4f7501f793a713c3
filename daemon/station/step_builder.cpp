#include "daemon/station/step_builder.h"

namespace scanrig {

std::string calibrated_job(const StationState& state) {
  if (state.queue.empty()) return {};
  const auto& head = *state.queue.front();
  return has_views(head) ? head.id : std::string();
}

/// A calibration is what mends it.
const Error* calibration_problem(const StationState& state) {
  if (!state.queue.empty() && state.queue.front()->recipe.is_calibration()) return nullptr;
  const auto& seen = state.calibration;
  return seen.problem && seen.job == calibrated_job(state) ? &*seen.problem : nullptr;
}

int next_pose(const ActiveJob& job) { return job.repeated.empty() ? job.pose + 1 : job.pose; }

std::optional<int> awaited_placement(const StationState& state) {
  if (state.activity == Activity::waiting_for_flip) {
    return state.job->recipe.is_calibration() ? std::optional(next_pose(*state.job)) : std::nullopt;
  }
  if (state.machine != MachineState::ready || state.queue.empty()) return std::nullopt;
  const auto& head = *state.queue.front();
  const bool stands = !head.stored.empty() && head.stored.back().pose == head.complete;
  return head.recipe.is_calibration() && !stands ? std::optional(head.complete) : std::nullopt;
}

bool StepBuilder::may_move() {
  switch (s().activity) {
    case Activity::warning:
    case Activity::homing:
    case Activity::jogging:
    case Activity::scanning:
    case Activity::storing: return true;
    default: return false;
  }
}

void StepBuilder::enter(MachineState machine, std::string cause) {
  s().machine = machine;
  s().activity = Activity::none;
  s().cause = std::move(cause);
}

void StepBuilder::warn() {
  s().activity = Activity::warning;
  act(action::Warn{});
}

void StepBuilder::stop_rig() {
  if (may_move()) s().table_deg.reset();
  s().activity = Activity::stopping;
  send_stop();
}

void StepBuilder::send_stop() {
  if (!s().hung) return act(action::StopRig{});
  if (s().hung->device == "turntable") return act(action::StopTableOutside{});
  act(action::StopTableDirectly{});
}

void StepBuilder::close_job(JobState state, Error why) {
  if (!s().job) return;
  s().unjudged.erase(s().job->id);
  act(action::CloseJob{s().job->id, state, std::move(why)});
  s().job.reset();
}

void StepBuilder::fault(std::string cause, std::string device) {
  close_job(JobState::interrupted, {ErrorCode::stopped, cause});
  s().machine = MachineState::error;
  s().latch = Latch{cause, device};
  s().cause = std::move(cause);
  s().auto_home_allowed = false;
  s().unclassified.reset();
  s().fault_device = std::move(device);
  s().maintenance.reset();
  stop_rig();
}

/// While a device failure waits for its cause, the e-stop is that cause: it takes the power of drives and adapters.
void StepBuilder::estop(std::string_view what) {
  const bool first = s().machine != MachineState::error || s().unclassified || !s().latch;
  if (first) return fault(std::string(what));
  if (s().cause.find(what) == std::string::npos) s().cause += fmt::format(" {}", what);
  s().latch->cause = s().cause;
  stop_rig();
}

std::string_view StepBuilder::meanwhile() {
  switch (s().activity) {
    case Activity::warning: return "before the table moved";
    case Activity::homing: return "while the table was homing";
    case Activity::jogging: return "while the table was jogging";
    case Activity::pulsing: return "while the projector flashed";
    case Activity::scanning: return "during a scan";
    case Activity::storing: return "while the last views were stored";
    default: return "while the rig was idle";
  }
}

void StepBuilder::fault_unclassified(const event::RigFailed& failure) {
  s().machine = MachineState::error;
  s().cause = "A device failed; checking for an e-stop.";
  s().latch = Latch{failure.error.message + ".", failure.device};
  s().auto_home_allowed = false;
  s().unclassified = failure.error;
  s().fault_device = failure.device;
  s().maintenance.reset();
  stop_rig();
  act(action::WaitForEstop{});
}

void StepBuilder::classify_fault() {
  if (!s().unclassified) return;
  s().cause = s().unclassified->message + ".";
  s().unclassified.reset();
  if (s().latch) s().latch->cause = s().cause;
  close_job(JobState::interrupted, {ErrorCode::stopped, s().cause});
}

const char* StepBuilder::unsafe() {
  if (!s().panel_known) return "E-stop state unknown: check the panel.";
  if (!s().estop_ok) return "The e-stop is pressed: release it first.";
  if (!s().guard_closed) return "The guard is open: close it first.";
  return nullptr;
}

bool StepBuilder::require_safe() {
  const char* const why_not = unsafe();
  if (why_not) refuse(ErrorCode::refused, "{}", why_not);
  return !why_not;
}

const DeviceHealth* StepBuilder::absent_device() {
  for (const auto& device : s().devices) {
    if (device.problem) return &device;
  }
  return nullptr;
}

bool StepBuilder::require_devices() {
  const auto* const absent = absent_device();
  if (!absent) return true;
  const auto& why = *absent->problem;
  // For the requester a device does not respond: the cause is neither the disk nor a file, whatever its port returns.
  const auto code = exit_code(why.code) == ExitCode::device ? why.code : ErrorCode::timeout;
  refuse(code, "The {} is not responding: {}.", absent->name, why.message);
  return false;
}

bool StepBuilder::require_calibration() {
  const auto* const problem = calibration_problem(s());
  if (problem) refuse(problem->code, "Check the calibration: {}.", problem->message);
  return !problem;
}

void StepBuilder::check() {
  act(action::CheckDevices{});
  act(action::CheckCalibration{calibrated_job(s())});
}

bool StepBuilder::require_disk() {
  const auto& problem = s().disk_problem;
  if (problem) refuse(problem->code, "Not now: {}.", problem->message);
  return !problem;
}

bool StepBuilder::remote_may_move(std::string_view what) {
  if (!rules_.remote || !rules_.guard) {
    refuse(ErrorCode::refused, "Remote {} is disabled: use the panel.", what);
  } else if (s().latch) {
    refuse(ErrorCode::refused, "Fix the cause, then press Reset at the panel.");
  } else {
    return true;
  }
  return false;
}

void StepBuilder::begin_homing(std::string cause) {
  s().machine = MachineState::initialized;
  s().cause = std::move(cause);
  s().auto_home_allowed = false;
  warn();
}

void StepBuilder::auto_home_if_allowed() {
  if (!rules_.auto_home || !rules_.guard || !s().auto_home_allowed) return;
  if (s().machine != MachineState::halted || s().activity != Activity::none || s().shutting_down) return;
  if (s().latch || unsafe()) return;
  begin_homing("The guard is closed.");
}

}  // namespace scanrig
