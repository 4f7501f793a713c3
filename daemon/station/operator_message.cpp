#include "daemon/station/operator_message.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <ranges>

#include "daemon/station/job_lifecycle.h"

namespace scanrig {
namespace {

constexpr const char* kKeepAway = "Keep clear.";
constexpr const char* kWaitForStanding = "Wait until the table has stopped.";
constexpr const char* kSeeToPanel = "Check the panel's power and cable.";

/// Steps before a button may let the table move: "release the e-stop, close the guard, ".
std::string steps_before_motion(const StationState& state) {
  std::string steps;
  if (!state.estop_ok) steps += "release the e-stop, ";
  if (!state.guard_closed) steps += "close the guard, ";
  return steps;
}

/// "Close the guard, then press Reset."; `action` starts with a small letter.
std::string after_steps(const StationState& state, const std::string& action) {
  const auto steps = steps_before_motion(state);
  auto text = steps.empty() ? action + "." : steps + "then " + action + ".";
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::string how_to_reset(const StationState& state, const StationRules& rules) {
  if (state.may_be_moving) return "Keep clear. Check the drive's power and cable.";
  if (state.hung) return "Wait: the service restarts itself. Then check the cable of the " + state.hung->device + ".";
  if (state.activity == Activity::stopping) return kWaitForStanding;
  if (state.unclassified) return "Wait: checking for an e-stop.";
  if (!state.panel_known) return kSeeToPanel;
  const bool by_guard = rules.auto_home && rules.guard && state.auto_home_allowed && !state.latch;
  if (by_guard && !state.guard_closed) return "Keep clear, then close the guard: the table homes.";
  if (!state.latch) return after_steps(state, "press Reset");
  const char* const reset = "press Reset at the panel";
  return steps_before_motion(state).empty() ? fmt::format("Fix the cause, then {}.", reset) : after_steps(state, reset);
}

/// Condition without which no job starts.
std::string see_to_absent(const StationState& state) {
  const auto absent =
      std::ranges::find_if(state.devices, [](const auto& device) { return device.problem.has_value(); });
  return absent == state.devices.end() ? "" : fmt::format("Check the {}: no response. ", absent->name);
}

std::string with_light(const StationRules& rules, const char* before, const std::string& action) {
  return rules.manual_light ? before + action : action;
}

std::string how_to_go_on_in_maintenance(const StationState& state, const StationRules& rules) {
  if (!state.panel_known) return kSeeToPanel;
  const bool may_jog = state.maintenance->homed && state.maintenance->may_jog(rules.guard);
  const char* const motion = may_jog ? "jog the table" : "press Reset at the panel to home the table";
  return after_steps(state, fmt::format("{}, or switch maintenance off", motion));
}

OperatorMessage when_lent(const StationState& state) {
  if (state.activity == Activity::stopping) return {"Setup ends: the rig is made safe.", kWaitForStanding};
  return {"Setup has the devices: nothing moves, no jobs.", "Answer its questions on the screen Service, or end it."};
}

OperatorMessage in_maintenance(const StationState& state, const StationRules& rules) {
  if (rules.lent) return when_lent(state);
  switch (state.activity) {
    case Activity::none: return {"Maintenance mode: no jobs.", how_to_go_on_in_maintenance(state, rules)};
    case Activity::warning: return {"Maintenance: the table is about to move.", kKeepAway};
    case Activity::stopping: return {"Maintenance: the table is stopping.", kWaitForStanding};
    case Activity::pulsing: return {"Maintenance: the projector flashes.", "Do not look into the projector."};
    default: return {fmt::format("Maintenance: {}.", to_string(state.activity)), kKeepAway};
  }
}

std::string fault_sentence(const StationState& state) {
  if (state.may_be_moving) return "The table may be moving: its drive does not respond.";
  return "A fault stopped the rig.";
}

std::string working_on_calibration(const StationState& state) {
  const auto& job = *state.job;
  const auto problem = job.image_problem.empty() ? "" : " " + job.image_problem;
  const int views = job.recipe.views_of(job.pose);
  if (job.turning) return "The table turns to the mark of the next placement.";
  if (job.closing)
    return fmt::format("Placement {} of {}: has the board slipped?{}", job.pose + 1, job.recipe.poses, problem);
  if (state.activity == Activity::storing)
    return fmt::format("Placement {}: checking its images.{}", job.pose + 1, problem);
  return fmt::format("Placement {} of {}: {} of {} views taken, {} stored.{}", job.pose + 1, job.recipe.poses,
                     job.taken, views, job.stored, problem);
}

std::string working(const StationState& state) {
  const auto& job = *state.job;
  if (state.activity != Activity::warning && job.recipe.is_calibration()) return working_on_calibration(state);
  switch (state.activity) {
    case Activity::warning: return "The table is about to move.";
    case Activity::scanning:
      if (job.closing) return fmt::format("Pose {} of {}: checking for movement.", job.pose + 1, job.recipe.poses);
      return fmt::format("Pose {} of {}: {} of {} views taken, {} stored.", job.pose + 1, job.recipe.poses, job.taken,
                         job.recipe.views, job.stored);
    case Activity::storing: return fmt::format("Storing the last views of pose {}.", job.pose + 1);
    default: return "";
  }
}

/// Effect of Start: depends on the head of the queue, and on how much of that job exists.
std::string how_to_start(const StationState& state) {
  const auto start = steps_before_motion(state) + "then press Start.";
  if (state.queue.empty()) return "Put a part on the table, " + start;
  const auto& head = *state.queue.front();
  const auto placement = awaited_placement(state);
  if (placement) return how_to_place(head.recipe.placement(*placement), state.guard_closed);
  if (head.recipe.is_calibration()) return "Do not move the board, " + start;
  const bool has_views = !head.stored.empty() && head.stored.back().pose == head.complete;
  const auto name = head.part.empty() ? "job " + head.id : head.part;
  if (has_views) return fmt::format("Do not move the part of {}, {}", name, start);
  if (head.complete > 0) return fmt::format("Put the part of {} on the table, turned over, {}", name, start);
  return fmt::format("Put the part for {} on the table, {}", name, start);
}

std::string see_to_calibration(const Error& problem) {
  return fmt::format("Check the calibration: {}.", problem.message);
}

bool warming_up(const StationState& state) { return state.warm_up_left > std::chrono::seconds(0); }

/// Reason why the next job does not start automatically: its part, or anything else although its part may be there.
std::string what_holds_the_line(const StationState& state) {
  if (const auto* problem = calibration_problem(state)) return see_to_calibration(*problem);
  if (state.quiet) return "Quiet hours: the queue continues when they end.";
  if (warming_up(state)) {
    return fmt::format("Projector warming up: {} s. Press Start to skip.", state.warm_up_left.count());
  }
  const char* const guard = state.guard_closed ? "." : ", then close the guard.";
  const auto absent = see_to_absent(state);
  if (!state.part_gone) return absent + "Remove the part, then load the next one" + guard;
  if (!state.inputs.part_present) return absent + "Load the next part" + guard;
  return absent + (state.guard_closed ? "Wait: the queue continues." : "Close the guard: the queue continues.");
}

OperatorMessage when_ready(const StationState& state, const StationRules& rules) {
  const auto queued = state.queue.size();
  auto sentence =
      queued == 0 ? std::string("The rig is ready.") : fmt::format("The rig is ready, {} in the queue.", queued);
  if (const auto placement = awaited_placement(state)) {
    const auto& recipe = state.queue.front()->recipe;
    sentence = recipe.is_check() ? "Check of the calibration."
                                 : fmt::format("Calibration, placement {} of {}.", *placement + 1, recipe.poses);
  }
  if (!state.calibration.reminder.empty()) sentence += " " + state.calibration.reminder;
  if (warming_up(state)) sentence += fmt::format(" The projector will be warm in {} s.", state.warm_up_left.count());
  if (const auto* problem = calibration_problem(state)) return {std::move(sentence), see_to_calibration(*problem)};
  return {std::move(sentence),
          with_light(rules, "Switch the projector on. ", see_to_absent(state) + how_to_start(state))};
}

/// Further checks for the operator: the next action alone would lead to the same problem again.
OperatorMessage with_disk(const StationState& state, OperatorMessage words) {
  if (state.disk_problem) words.sentence += " The job disk does not respond.";
  if (state.disk_trouble) words.next_action.insert(0, "Check the job disk. ");
  return words;
}

/// The automation turned the part over.
std::string how_to_go_on(const StationState& state) {
  return state.guard_closed ? "The scan continues." : "Close the guard: the scan continues.";
}

OperatorMessage when_waiting_for_board(const StationState& state) {
  const auto& job = *state.job;
  const auto action = see_to_absent(state) + how_to_place(job.recipe.placement(next_pose(job)), state.guard_closed);
  if (job.repeated.empty()) {
    return {fmt::format("Placement {} of {} is complete.", job.pose + 1, job.recipe.poses), action};
  }
  return {fmt::format("Placement {} of {} again: {}.", job.pose + 1, job.recipe.poses, job.repeated), action};
}

OperatorMessage when_executing(const StationState& state) {
  const bool calibrates = state.job && state.job->recipe.is_calibration();
  if (calibrates && state.activity == Activity::waiting_for_flip) return when_waiting_for_board(state);
  if (state.activity == Activity::waiting_for_flip) {
    return {fmt::format("Pose {} of {} is complete.", state.job->pose + 1, state.job->recipe.poses),
            see_to_absent(state) +
                (state.job->turned_over ? how_to_go_on(state) : how_to_flip(state.job->recipe, state.guard_closed))};
  }
  if (state.activity == Activity::waiting_for_part) {
    return {fmt::format("Waiting for the next part, {} in the queue.", state.queue.size()), what_holds_the_line(state)};
  }
  const char* const what = calibrates ? "board" : "part";
  if (state.activity == Activity::storing) return {working(state), fmt::format("Do not move the {}.", what)};
  return {working(state), fmt::format("Keep clear. Do not move the {}.", what)};
}

}  // namespace

std::string how_to_flip(const Recipe& recipe, bool guard_closed) {
  const char* const guard = guard_closed ? "" : "close the guard, ";
  if (!recipe.flip_by_signal) {
    return fmt::format("Turn the part over so that its underside faces the cameras, {}then press Start.", guard);
  }
  return guard_closed ? "Wait: the automation turns the part over."
                      : "Close the guard: the automation turns the part over.";
}

std::string how_to_place(const Placement& placement, bool guard_closed) {
  const char* const guard = guard_closed ? "Then" : "Then close the guard and";
  if (placement.is_flat()) return fmt::format("Lay the board flat, its centre on the axis. {} press Start.", guard);
  const auto centre = placement.front_mm == 0.0 ? std::string("on the axis")
                                                : fmt::format("{:.0f} mm {} the axis", std::abs(placement.front_mm),
                                                              placement.front_mm > 0.0 ? "in front of" : "behind");
  return fmt::format("Put the board at mark {:.0f}: {}, {:.0f} deg from flat, centre {}{}. {} press Start.",
                     placement.mark_deg, placement.portrait ? "portrait" : "landscape", placement.tilt_deg, centre,
                     placement.on_block ? ", on the block" : "", guard);
}

OperatorMessage describe(const StationState& state, const StationRules& rules) {
  switch (state.machine) {
    case MachineState::preoperational: return {"Opening the devices.", "Wait until the panel responds."};
    case MachineState::halted:
      if (state.reloading) return {"Reloading the configuration.", "Wait until it has restarted."};
      if (state.shutting_down) return {"The service is shutting down.", "Wait until it has ended."};
      return with_disk(state, {"The table is not homed.", how_to_reset(state, rules)});
    case MachineState::maintenance: return in_maintenance(state, rules);
    case MachineState::error:
      return {fault_sentence(state), with_light(rules, "Switch the projector off. ", how_to_reset(state, rules))};
    case MachineState::initialized:
      return {state.activity == Activity::warning ? "The table is about to move." : "The table is homing.", kKeepAway};
    case MachineState::ready: return with_disk(state, when_ready(state, rules));
    case MachineState::single_execution:
    case MachineState::continuous_execution: return when_executing(state);
  }
  return {};
}

// One job.

namespace {

std::string why(const JobInfo& job) { return job.error ? job.error->message : "no reason recorded"; }

/// Views of the current pose.
auto views_of_pose(const JobInfo& job) {
  return std::ranges::count(job.stored, job.complete, [](const StoredView& view) { return view.pose; });
}

OperatorMessage when_queued(const JobInfo& job) {
  const std::string sentence = job.stored.empty() ? "Queued." : "Queued to resume.";
  if (job.recipe.is_calibration()) {
    const auto& placement = job.recipe.placement(job.complete);
    return {job.recipe.is_check() ? "Check of the calibration queued." : "Calibration queued.",
            views_of_pose(job) > 0 ? "Do not move the board. Press Start." : how_to_place(placement)};
  }
  if (job.complete > 0 && views_of_pose(job) == 0) {
    return {sentence, "When first in the queue, put its part on the table, turned over. Press Start."};
  }
  if (job.recipe.start_on_part) {
    return {sentence, "When first in the queue, load the part. Start begins the series."};
  }
  return {sentence, "When first in the queue, press Start."};
}

std::string making_model(const JobInfo& job) {
  const auto stage = std::ranges::find_if(job.stages, [](const StageShare& share) { return share.fraction < 1.0; });
  if (stage == job.stages.end()) return "Reconstructing.";
  return fmt::format("Reconstructing: {}, {:.0f} %.", stage->name, 100 * stage->fraction);
}

OperatorMessage when_failed(const JobInfo& job) {
  const auto sentence = fmt::format("Failed: {}.", why(job));
  if (job.quarantined) return {sentence, "Send a bundle to support or reprocess."};
  if (job.error && job.error->code == ErrorCode::ambiguous && !job.choices.empty()) {
    return {sentence, "Choose the image that is right, or add a pose that decides."};
  }
  const bool images_are_good = job.error && job.complete == job.recipe.poses && job.error->code != ErrorCode::moved &&
                               job.error->code != ErrorCode::same_rest;
  return {sentence, images_are_good ? "Reprocess with other options, or scan the part again." : "Scan the part again."};
}

OperatorMessage when_interrupted(const JobInfo& job) {
  const auto sentence = fmt::format("Interrupted: {}.", why(job));
  if (!is_resumable(job)) return {sentence, "Cancel the job, then scan the part again."};
  if (views_of_pose(job) > 0) return {sentence, "Do not move the part. Resume the job, then press Start."};
  if (job.complete > 0) return {sentence, "Put its part on the table, turned over. Resume the job, then press Start."};
  return {sentence, "Put its part on the table. Resume the job, then press Start."};
}

/// The last view with a problem, of the current placement.
std::string image_problem(const JobInfo& job) {
  for (auto view = job.stored.rbegin(); view != job.stored.rend() && view->pose == job.complete; ++view) {
    if (view->problems && !view->problems->empty()) {
      return fmt::format(" View {}, {}", view->view + 1, view->problems->front());
    }
  }
  return "";
}

/// What follows from the verdict of a check.
std::string after_check(const CalibrationOutcome& outcome) {
  if (outcome.is_accepted || outcome.verdict == "holds") return "Scan.";
  return outcome.verdict == "moved" ? "Accept the new poses: run scanrig calibrate --accept."
                                    : "Calibrate the rig: run scanrig calibrate --rig.";
}

OperatorMessage when_solved(const JobInfo& job) {
  const auto outcome = job.calibration.value_or(CalibrationOutcome{});
  if (job.recipe.is_check()) {
    auto found = fmt::format("{}", fmt::join(outcome.sentences, " "));
    return {found + (outcome.is_accepted ? " They are in use." : ""), after_check(outcome)};
  }
  auto sentence = fmt::format("Calibration of grade {}{}.", outcome.grade, outcome.is_accepted ? " is in use" : "");
  for (const auto& more : outcome.sentences) sentence += " " + more;
  return {sentence, outcome.is_accepted ? "Scan." : "Accept it: run scanrig calibrate --accept."};
}

OperatorMessage describe_calibration(const JobInfo& job) {
  const int pose = job.complete + 1, all = job.recipe.poses;
  switch (job.state) {
    case JobState::scanning:
      return {fmt::format("Placement {} of {}: {} of {} views stored.{}", pose, all, views_of_pose(job),
                          job.recipe.views_of(job.complete), image_problem(job)),
              "Do not move the board."};
    case JobState::waiting_for_flip:
      return {job.repeated.empty() ? fmt::format("Placement {} of {} is complete.", job.complete, all)
                                   : fmt::format("Placement {} of {} again: {}.", pose, all, job.repeated),
              how_to_place(job.recipe.placement(job.complete))};
    case JobState::reconstructing:
      return {job.recipe.is_check() ? "Comparing with the calibration." : "Solving the calibration.",
              "Wait for the result."};
    case JobState::done: return when_solved(job);
    case JobState::interrupted:
      return {
          fmt::format("Interrupted: {}.", why(job)),
          fmt::format("{}Resume the job, then press Start.", views_of_pose(job) > 0 ? "Do not move the board. " : "")};
    case JobState::cancelled: return {fmt::format("Cancelled: {}.", why(job)), "Calibrate again if needed."};
    default: return {fmt::format("Failed: {}.", why(job)), "The old calibration stays. Calibrate again."};
  }
}

}  // namespace

OperatorMessage describe(const JobInfo& job) {
  if (job.recipe.is_calibration() && job.state != JobState::queued) return describe_calibration(job);
  switch (job.state) {
    case JobState::queued: return when_queued(job);
    case JobState::scanning:
      return {fmt::format("Pose {} of {}: {} of {} views stored.", job.complete + 1, job.recipe.poses,
                          views_of_pose(job), job.recipe.views),
              "Do not move the part."};
    case JobState::waiting_for_flip:
      return {fmt::format("Pose {} of {} is complete.", job.complete, job.recipe.poses), how_to_flip(job.recipe)};
    case JobState::reconstructing: return {making_model(job), "Wait for the model."};
    case JobState::done:
      if (job.passed.value_or(true)) {
        return {fmt::format("The model is ready.{}{}", job.remarks.empty() ? "" : " ", fmt::join(job.remarks, " ")),
                "Check the model."};
      }
      return {fmt::format("Model outside the recipe's limits: {}.", why(job)),
              fmt::format("Check the model. Add a pose, scan the part again, or change the limits of recipe {}.",
                          job.recipe.name)};
    case JobState::failed: return when_failed(job);
    case JobState::interrupted: return when_interrupted(job);
    case JobState::cancelled: return {fmt::format("Cancelled: {}.", why(job)), "Scan the part again if needed."};
  }
  return {};
}

}  // namespace scanrig
