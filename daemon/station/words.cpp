#include "daemon/station/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace scanrig {
namespace {

constexpr const char* kKeepAway = "Keep away from the table.";
constexpr const char* kWaitForStanding = "Wait until the table is seen standing.";
constexpr const char* kSeeToPanel = "See to the panel: it cannot be read.";

/// What is between here and a button that lets the table move: "release the e-stop, close the guard, ".
std::string steps_before_motion(const StationState& state) {
  std::string steps;
  if (!state.estop_ok) steps += "release the e-stop, ";
  if (!state.guard_closed) steps += "close the guard, ";
  return steps;
}

/// "Close the guard, then press Reset."; `action` begins with a small letter.
std::string after_steps(const StationState& state, const std::string& action) {
  const auto steps = steps_before_motion(state);
  auto text = steps.empty() ? action + "." : steps + "then " + action + ".";
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::string how_to_reset(const StationState& state, const StationRules& rules) {
  if (state.may_be_moving) return "Keep away from the table. See to the drive's power and cable; it is being stopped.";
  if (state.activity == Activity::stopping) return kWaitForStanding;
  if (state.unnamed) return "Wait a moment: it is being looked whether it was the e-stop.";
  if (!state.panel_known) return kSeeToPanel;
  const bool by_guard = rules.home_guarded && rules.guard && state.home_by_guard && !state.latched;
  if (by_guard && !state.guard_closed) return "Keep away from the table and close the guard: the table homes then.";
  if (!state.latched) return after_steps(state, "press Reset");
  const char* const reset = "press Reset at the panel";
  return steps_before_motion(state).empty() ? fmt::format("See to the cause, then {}.", reset)
                                            : after_steps(state, reset);
}

/// No job begins without it.
std::string see_to_absent(const StationState& state) {
  const auto absent =
      std::ranges::find_if(state.devices, [](const auto& device) { return device.problem.has_value(); });
  return absent == state.devices.end() ? "" : fmt::format("See to the {}: it is not there. ", absent->name);
}

std::string with_light(const StationRules& rules, const char* before, const std::string& action) {
  return rules.manual_light ? before + action : action;
}

std::string how_to_go_on_in_maintenance(const StationState& state, const StationRules& rules) {
  if (!state.panel_known) return kSeeToPanel;
  const bool may_jog = state.maintenance->homed && (rules.guard || state.maintenance->consent);
  const char* const motion = may_jog ? "jog the table" : "press Reset at the panel to home the table";
  return after_steps(state, fmt::format("{}, or switch maintenance off", motion));
}

Words in_maintenance(const StationState& state, const StationRules& rules) {
  switch (state.activity) {
    case Activity::none: return {"Maintenance: there are no jobs.", how_to_go_on_in_maintenance(state, rules)};
    case Activity::warning: return {"Maintenance: the table is about to move.", kKeepAway};
    case Activity::stopping: return {"Maintenance: the table is being stopped.", kWaitForStanding};
    case Activity::pulsing: return {"Maintenance: the projector flashes.", "Do not look into the projector."};
    default: return {fmt::format("Maintenance: {}.", to_string(state.activity)), kKeepAway};
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
  const auto start = steps_before_motion(state) + "then press Start.";
  if (state.queue.empty()) return "Put an object on the table, " + start;
  const auto& head = *state.queue.front();
  const bool has_views = !head.stored.empty() && head.stored.back().pose == head.complete;
  const auto name = head.part.empty() ? "job " + head.id : head.part;
  if (has_views) return fmt::format("{} goes on where it stopped: leave its object as it lies, {}", name, start);
  if (head.complete > 0) return fmt::format("Put the object of {} on the table, turned over, {}", name, start);
  return fmt::format("Put the object for {} on the table, {}", name, start);
}

std::string see_to_calibration(const Error& problem) {
  return fmt::format("See to the calibration: {}.", problem.message);
}

bool warming_up(const StationState& state) { return state.warm_up_left > std::chrono::seconds(0); }

/// What keeps the next job from beginning by itself: its part, or everything else although its part may be there.
std::string what_holds_the_line(const StationState& state) {
  if (const auto* problem = calibration_problem(state)) return see_to_calibration(*problem);
  if (state.quiet) return "Quiet hours: the queue goes on when they end.";
  if (warming_up(state)) {
    return fmt::format("The projector is warming up: the queue goes on in {} s, or at once with Start.",
                       state.warm_up_left.count());
  }
  const char* const guard = state.guard_closed ? "." : ", then close the guard.";
  const auto absent = see_to_absent(state);
  if (!state.part_gone) return absent + "Take the part away, then put the next one on the table" + guard;
  if (!state.inputs.part_present) return absent + "Put the next part on the table" + guard;
  return absent + (state.guard_closed ? "The queue goes on then." : "Close the guard: the queue goes on then.");
}

Words when_ready(const StationState& state, const StationRules& rules) {
  const auto queued = state.queue.size();
  auto sentence =
      queued == 0 ? std::string("The rig is ready.") : fmt::format("The rig is ready, {} in the queue.", queued);
  if (warming_up(state)) sentence += fmt::format(" The projector will be warm in {} s.", state.warm_up_left.count());
  if (const auto* problem = calibration_problem(state)) return {std::move(sentence), see_to_calibration(*problem)};
  return {std::move(sentence),
          with_light(rules, "Switch the projector on. ", see_to_absent(state) + how_to_start(state))};
}

/// What has to be seen to besides: the next action alone would lead into the same trouble again.
Words with_disk(const StationState& state, Words words) {
  if (state.disk_problem) words.sentence += " The disk of the jobs does not answer.";
  if (state.disk_trouble) words.next_action.insert(0, "See to the disk of the jobs. ");
  return words;
}

/// The line has turned the object over.
std::string how_to_go_on(const StationState& state) {
  return state.guard_closed ? "The scan goes on then." : "Close the guard: the scan goes on then.";
}

Words when_executing(const StationState& state) {
  if (state.activity == Activity::waiting_for_flip) {
    return {fmt::format("Pose {} of {} is complete.", state.job->pose + 1, state.job->recipe.poses),
            see_to_absent(state) +
                (state.job->turned_over ? how_to_go_on(state) : how_to_flip(state.job->recipe, state.guard_closed))};
  }
  if (state.activity == Activity::waiting_for_part) {
    return {fmt::format("Waiting for the next part, {} in the queue.", state.queue.size()), what_holds_the_line(state)};
  }
  if (state.activity == Activity::storing) return {working(state), "Leave the object as it lies."};
  return {working(state), "Keep away from the table, and leave the object as it lies."};
}

}  // namespace

std::string how_to_flip(const Recipe& recipe, bool guard_closed) {
  const char* const guard = guard_closed ? "" : "close the guard, ";
  if (!recipe.flip_by_line) {
    return fmt::format("Turn the object over so that its underside faces the cameras, {}then press Start.", guard);
  }
  return guard_closed ? "The line is asked to turn the object over."
                      : "Close the guard: the line is asked to turn the object over.";
}

Words describe(const StationState& state, const StationRules& rules) {
  switch (state.machine) {
    case MachineState::preoperational: return {"The devices are being opened.", "Wait until the panel answers."};
    case MachineState::halted:
      if (state.reloading) return {"The daemon begins again with a new configuration.", "Wait until it has begun."};
      if (state.shutting_down) return {"The daemon is shutting down.", "Wait until it has ended."};
      return with_disk(state, {"The table is not homed.", how_to_reset(state, rules)});
    case MachineState::maintenance: return in_maintenance(state, rules);
    case MachineState::error:
      return {fault_sentence(state), with_light(rules, "Switch the projector off. ", how_to_reset(state, rules))};
    case MachineState::initialized:
      return {state.activity == Activity::warning ? "The table is about to move." : "The table is finding home.",
              kKeepAway};
    case MachineState::ready: return with_disk(state, when_ready(state, rules));
    case MachineState::single_execution:
    case MachineState::continuous_execution: return when_executing(state);
  }
  return {};
}

}  // namespace scanrig
