#include "daemon/station/words.h"

#include <fmt/format.h>

namespace scanrig {
namespace {

std::string how_to_reset(const StationState& state) {
  if (state.may_be_moving) return "Keep away from the table. See to the drive's power and cable; it is being stopped.";
  if (state.activity == Activity::stopping) return "Wait until the table is seen standing.";
  if (!state.panel_known) return "See to the panel: it cannot be read.";
  if (!state.estop_ok) return "Release the e-stop, then press Reset.";
  if (!state.guard_closed) return "Close the guard, then press Reset.";
  return state.latched ? "See to the cause, then press Reset at the panel." : "Press Reset.";
}

std::string with_light(const StationRules& rules, const char* before, const std::string& action) {
  return rules.manual_light ? before + action : action;
}

Words in_maintenance(const StationState& state) {
  switch (state.activity) {
    case Activity::none: return {"Maintenance: there are no jobs.", ""};
    case Activity::warning: return {"Maintenance: the table is about to move.", ""};
    case Activity::stopping: return {"Maintenance: the table is being stopped.", ""};
    default: return {fmt::format("Maintenance: {}.", to_string(state.activity)), ""};
  }
}

std::string fault_sentence(const StationState& state) {
  if (state.may_be_moving) return "The table may be moving: its drive does not answer.";
  return "A fault stopped the rig.";
}

std::string working(const StationState& state) {
  const auto& job = *state.job;
  switch (state.activity) {
    case Activity::warning: return "The table is about to move.";
    case Activity::scanning:
      if (job.closing) return fmt::format("Pose {} of {}: view 0 is taken again.", job.pose + 1, job.recipe.poses);
      return fmt::format("Pose {} of {}: {} of {} views taken, {} stored.", job.pose + 1, job.recipe.poses, job.taken,
                         job.recipe.views, job.stored);
    case Activity::storing: return fmt::format("Storing the last views of pose {}.", job.pose + 1);
    default: return "";
  }
}

/// What Start would do: the head of the queue tells, and what of it is there already.
std::string how_to_start(const StationState& state) {
  if (state.queue.empty()) return "Put an object on the table, then press Start.";
  const auto& head = *state.queue.front();
  const bool has_views = !head.stored.empty() && head.stored.back().pose == head.complete;
  const auto name = head.part.empty() ? "job " + head.id : head.part;
  if (has_views) return fmt::format("{} goes on where it stopped: leave its object as it lies, press Start.", name);
  if (head.complete > 0) return fmt::format("Put the object of {} on the table, turned over, then press Start.", name);
  return fmt::format("Put the object for {} on the table, then press Start.", name);
}

bool warming_up(const StationState& state) { return state.warm_up_left > std::chrono::seconds(0); }

/// What keeps the next job from beginning by itself although its part may be there.
std::string what_holds_the_line(const StationState& state) {
  if (state.quiet) return "Quiet hours: the queue goes on when they end.";
  if (!warming_up(state)) return "";
  return fmt::format("The projector is warming up: the queue goes on in {} s, or at once with Start.",
                     state.warm_up_left.count());
}

Words when_ready(const StationState& state, const StationRules& rules) {
  const auto queued = state.queue.size();
  auto sentence =
      queued == 0 ? std::string("The rig is ready.") : fmt::format("The rig is ready, {} in the queue.", queued);
  if (warming_up(state)) sentence += fmt::format(" The projector will be warm in {} s.", state.warm_up_left.count());
  return {std::move(sentence), with_light(rules, "Switch the projector on. ", how_to_start(state))};
}

/// What has to be seen to besides: the next action alone would lead into the same trouble again.
Words with_disk(const StationState& state, Words words) {
  if (state.disk_problem) words.sentence += " The disk of the jobs does not answer.";
  if (state.disk_trouble) words.next_action.insert(0, "See to the disk of the jobs. ");
  return words;
}

Words when_executing(const StationState& state) {
  if (state.activity == Activity::waiting_for_flip) {
    return {fmt::format("Pose {} of {} is complete.", state.job->pose + 1, state.job->recipe.poses),
            how_to_flip(state.job->recipe)};
  }
  if (state.activity == Activity::waiting_for_part) {
    return {fmt::format("Waiting for the next part, {} in the queue.", state.queue.size()), what_holds_the_line(state)};
  }
  return {working(state), ""};
}

}  // namespace

std::string how_to_flip(const Recipe& recipe) {
  return recipe.flip_by_line ? "The line is asked to turn the object over."
                             : "Turn the object over so that its underside faces the cameras, then press Start.";
}

Words describe(const StationState& state, const StationRules& rules) {
  switch (state.machine) {
    case MachineState::preoperational: return {"The devices are being opened.", ""};
    case MachineState::halted:
      if (state.reloading) return {"The daemon begins again with a new configuration.", ""};
      if (state.shutting_down) return {"The daemon is shutting down.", ""};
      return with_disk(state, {"The table is not homed.", how_to_reset(state)});
    case MachineState::maintenance: return in_maintenance(state);
    case MachineState::error:
      return {fault_sentence(state), with_light(rules, "Switch the projector off. ", how_to_reset(state))};
    case MachineState::initialized:
      return {state.activity == Activity::warning ? "The table is about to move." : "The table is finding home.", ""};
    case MachineState::ready: return with_disk(state, when_ready(state, rules));
    case MachineState::single_execution:
    case MachineState::continuous_execution: return when_executing(state);
  }
  return {};
}

}  // namespace scanrig
