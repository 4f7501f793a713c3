#include "daemon/station/states.h"

namespace scanrig {

std::string_view to_string(MachineState state) {
  switch (state) {
    case MachineState::preoperational: return "Preoperational";
    case MachineState::halted: return "Halted";
    case MachineState::maintenance: return "Halted.Maintenance";
    case MachineState::error: return "Error";
    case MachineState::initialized: return "Operational.Initialized";
    case MachineState::ready: return "Operational.Ready";
    case MachineState::single_execution: return "Operational.SingleExecution";
    case MachineState::continuous_execution: return "Operational.ContinuousExecution";
  }
  return "unknown";
}

std::string_view to_string(JobState state) {
  switch (state) {
    case JobState::queued: return "queued";
    case JobState::scanning: return "scanning";
    case JobState::waiting_for_flip: return "waiting_for_flip";
    case JobState::reconstructing: return "reconstructing";
    case JobState::done: return "done";
    case JobState::failed: return "failed";
    case JobState::interrupted: return "interrupted";
    case JobState::cancelled: return "cancelled";
  }
  return "unknown";
}

std::string_view to_string(Activity activity) {
  switch (activity) {
    case Activity::none: return "none";
    case Activity::warning: return "warning";
    case Activity::homing: return "homing";
    case Activity::jogging: return "jogging";
    case Activity::pulsing: return "pulsing";
    case Activity::scanning: return "scanning";
    case Activity::storing: return "storing";
    case Activity::waiting_for_flip: return "waiting_for_flip";
    case Activity::waiting_for_part: return "waiting_for_part";
    case Activity::stopping: return "stopping";
  }
  return "unknown";
}

std::string_view to_string(Button button) {
  switch (button) {
    case Button::start: return "start";
    case Button::stop: return "stop";
    case Button::reset: return "reset";
  }
  return "unknown";
}

std::optional<JobState> parse_job_state(std::string_view name) {
  for (const auto state : {JobState::queued, JobState::scanning, JobState::waiting_for_flip, JobState::reconstructing,
                           JobState::done, JobState::failed, JobState::interrupted, JobState::cancelled}) {
    if (name == to_string(state)) return state;
  }
  return std::nullopt;
}

}  // namespace scanrig
