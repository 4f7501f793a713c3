#pragma once

#include <optional>
#include <string_view>

namespace scanrig {

/// The machine, in the words of OPC 40100-1. `initialized` covers homing, `maintenance` is halted with
/// an engineer at the rig, `continuous_execution` goes from job to job as parts come.
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

/// What the rig is busy with, inside a machine state.
enum class Activity {
  none,
  warning,  ///< the lamp warns, nothing moves yet
  homing,
  jogging,           ///< maintenance: turning to where the engineer wants it
  pulsing,           ///< maintenance: one flash of the projector
  scanning,          ///< turning and exposing
  storing,           ///< all views of the pose are taken, the last ones go to disk
  waiting_for_flip,  ///< standing, dark
  waiting_for_part,  ///< continuous: the next job begins when a new part is seen
  stopping,          ///< told to stop, not yet seen standing and dark
};

enum class Button { start, stop, reset };
enum class Origin { panel, remote };

std::string_view to_string(MachineState state);  ///< "Operational.Ready"
std::string_view to_string(JobState state);      ///< "waiting_for_flip"
std::string_view to_string(Activity activity);
std::string_view to_string(Button button);
std::optional<JobState> parse_job_state(std::string_view name);

/// Nothing more will happen to the job.
constexpr bool is_final(JobState state) {
  return state == JobState::done || state == JobState::failed || state == JobState::interrupted ||
         state == JobState::cancelled;
}

}  // namespace scanrig
