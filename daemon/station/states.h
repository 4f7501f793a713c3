#pragma once

#include <optional>
#include <string_view>

namespace scanrig {

/// The states of the machine, named as in OPC 40100-1. `initialized` covers homing, `maintenance` is halted with
/// an engineer at the rig, `continuous_execution` continues from job to job as parts come.
enum class MachineState {
  preoperational,
  halted,
  maintenance,
  error,
  initialized,
  ready,
  single_execution,
  continuous_execution
};

enum class JobState { queued, scanning, waiting_for_flip, reconstructing, done, failed, interrupted, cancelled };

/// Activity of the rig inside a machine state.
enum class Activity {
  none,
  warning,  ///< the lamp warns, nothing moves yet
  homing,
  jogging,           ///< maintenance: turning to the engineer's target
  pulsing,           ///< maintenance: one flash of the projector
  scanning,          ///< turning and exposing
  storing,           ///< all views of the pose are taken, the last ones go to disk
  waiting_for_flip,  ///< stopped, projector off
  waiting_for_part,  ///< continuous: the next job starts when a new part is detected
  stopping,          ///< commanded to stop, not yet confirmed stopped and dark
};

enum class Button { start, stop, reset };
enum class Origin { panel, remote };

std::string_view to_string(MachineState state);  ///< "Operational.Ready"
std::string_view to_string(JobState state);      ///< "waiting_for_flip"
std::string_view to_string(Activity activity);
std::string_view to_string(Button button);
std::optional<JobState> parse_job_state(std::string_view name);

/// The job has ended for good.
constexpr bool is_final(JobState state) {
  return state == JobState::done || state == JobState::failed || state == JobState::interrupted ||
         state == JobState::cancelled;
}

}  // namespace scanrig
