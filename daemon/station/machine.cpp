#include "daemon/station/machine.h"

namespace scanrig {

std::string calibrated_job(const StationState& state) {
  if (state.queue.empty()) return {};
  const auto& head = *state.queue.front();
  return has_views(head) ? head.id : std::string();
}

const Error* calibration_problem(const StationState& state) {
  const auto& seen = state.calibration;
  return seen.problem && seen.job == calibrated_job(state) ? &*seen.problem : nullptr;
}

bool Machine::may_move() {
  switch (s().activity) {
    case Activity::warning:
    case Activity::homing:
    case Activity::jogging:
    case Activity::scanning:
    case Activity::storing: return true;
    default: return false;
  }
}

void Machine::enter(MachineState machine, std::string cause) {
  s().machine = machine;
  s().activity = Activity::none;
  s().cause = std::move(cause);
}

void Machine::warn() {
  s().activity = Activity::warning;
  act(action::Warn{});
}

void Machine::stop_rig() {
  s().activity = Activity::stopping;
  act(action::StopRig{});
}

void Machine::close_job(JobState state, Error why) {
  if (!s().job) return;
  s().unjudged.erase(s().job->id);
  act(action::CloseJob{s().job->id, state, std::move(why)});
  s().job.reset();
}

void Machine::fault(std::string cause, std::string device) {
  close_job(JobState::interrupted, {ErrorCode::stopped, cause});
  s().machine = MachineState::error;
  s().cause = std::move(cause);
  s().latched = true;
  s().home_by_guard = false;
  s().unnamed.reset();
  s().fault_device = std::move(device);
  s().maintenance.reset();
  stop_rig();
}

void Machine::fault_unnamed(const event::RigFailed& failure) {
  s().machine = MachineState::error;
  s().cause = "A device failed; looking whether it was the e-stop.";
  s().latched = true;
  s().home_by_guard = false;
  s().unnamed = failure.error;
  s().fault_device = failure.device;
  s().maintenance.reset();
  stop_rig();
  act(action::WaitForEstop{});
}

void Machine::name_fault() {
  if (!s().unnamed) return;
  s().cause = s().unnamed->message + ".";
  s().unnamed.reset();
  close_job(JobState::interrupted, {ErrorCode::stopped, s().cause});
}

const char* Machine::unsafe() {
  if (!s().panel_known) return "The panel cannot be read, so nobody knows about the e-stop: see to the panel first.";
  if (!s().estop_ok) return "The e-stop is pressed: release it first.";
  if (!s().guard_closed) return "The guard is open: close it first.";
  return nullptr;
}

bool Machine::safe_to_move() {
  const char* const why_not = unsafe();
  if (why_not) refuse(ErrorCode::refused, "{}", why_not);
  return !why_not;
}

const DeviceHealth* Machine::absent_device() {
  for (const auto& device : s().devices) {
    if (device.problem) return &device;
  }
  return nullptr;
}

bool Machine::all_there() {
  const auto* const absent = absent_device();
  if (!absent) return true;
  const auto& why = *absent->problem;
  // To whoever asked it is a device that does not answer, and neither the disk nor a file, whatever its port says.
  const auto code = exit_code(why.code) == ExitCode::device ? why.code : ErrorCode::timeout;
  refuse(code, "The {} is not there: {}.", absent->name, why.message);
  return false;
}

bool Machine::calibrated() {
  const auto* const problem = calibration_problem(s());
  if (problem) refuse(problem->code, "See to the calibration: {}.", problem->message);
  return !problem;
}

void Machine::check() {
  act(action::CheckDevices{});
  act(action::CheckCalibration{calibrated_job(s())});
}

bool Machine::disk_answers() {
  const auto& problem = s().disk_problem;
  if (problem) refuse(problem->code, "Not now: {}.", problem->message);
  return !problem;
}

bool Machine::remote_may_move(std::string_view what) {
  if (!rules_.remote || !rules_.guard) {
    refuse(ErrorCode::refused, "Remote {} is switched off: do it at the panel.", what);
  } else if (s().latched) {
    refuse(ErrorCode::refused, "A fault is cleared at the panel only: see to it, then press Reset there.");
  } else {
    return true;
  }
  return false;
}

void Machine::begin_homing(std::string cause) {
  s().machine = MachineState::initialized;
  s().cause = std::move(cause);
  s().home_by_guard = false;
  warn();
}

void Machine::home_if_guarded() {
  if (!rules_.home_guarded || !rules_.guard || !s().home_by_guard) return;
  if (s().machine != MachineState::halted || s().activity != Activity::none || s().shutting_down) return;
  if (unsafe()) return;
  begin_homing("The guard is closed.");
}

}  // namespace scanrig
