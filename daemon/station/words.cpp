#include "daemon/station/words.h"

#include <fmt/format.h>

namespace scanrig {
namespace {

std::string how_to_reset(const StationState& state) {
  if (state.activity == Activity::stopping) return "Wait until the table is seen standing.";
  if (!state.estop_ok) return "Release the e-stop, then press Reset.";
  if (!state.guard_closed) return "Close the guard, then press Reset.";
  return "Press Reset.";
}

std::string working(const StationState& state, const StationRules& rules) {
  const auto& job = *state.job;
  switch (state.activity) {
    case Activity::warning: return "The table is about to move.";
    case Activity::scanning:
      return fmt::format("Pose {} of {}: {} of {} views taken, {} stored.", job.pose + 1, rules.poses, job.taken,
                         rules.views, job.stored);
    case Activity::storing: return fmt::format("Storing the last views of pose {}.", job.pose + 1);
    default: return "";
  }
}

}  // namespace

Words describe(const StationState& state, const StationRules& rules) {
  switch (state.machine) {
    case MachineState::preoperational: return {"The devices are being opened.", ""};
    case MachineState::halted:
      if (state.shutting_down) return {"The daemon is shutting down.", ""};
      return {"The table is not homed.", how_to_reset(state)};
    case MachineState::error: return {"A fault stopped the rig.", how_to_reset(state)};
    case MachineState::initialized:
      return {state.activity == Activity::warning ? "The table is about to move." : "The table is finding home.", ""};
    case MachineState::ready: return {"The rig is ready.", "Put an object on the table, then press Start."};
    case MachineState::single_execution:
      if (state.activity == Activity::waiting_for_flip) {
        return {fmt::format("Pose {} of {} is complete.", state.job->pose + 1, rules.poses),
                "Turn the object over so that its underside faces the cameras, then press Start."};
      }
      return {working(state, rules), ""};
  }
  return {};
}

}  // namespace scanrig
