// What is seen from afar: lamps, the word of the page, and what may be pressed.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/station/operator_message.h"

namespace scanrig {
namespace {

Headline of_scan(const StationState& state) {
  const auto& job = *state.job;
  const int views = job.recipe.views_of(job.pose);
  switch (state.activity) {
    case Activity::storing: return {Tone::working, "STORING"};
    case Activity::waiting_for_flip: return {Tone::act, job.recipe.is_calibration() ? "BOARD" : "FLIP"};
    case Activity::scanning:
      if (job.turning) return {Tone::working, "TURNING"};
      return {Tone::working, job.closing ? "CHECK" : fmt::format("{}/{}", std::min(job.taken + 1, views), views)};
    default: return {Tone::working, "WAIT"};
  }
}

}  // namespace

std::string_view to_string(Tone tone) {
  switch (tone) {
    case Tone::idle: return "idle";
    case Tone::ready: return "ready";
    case Tone::working: return "working";
    case Tone::act: return "act";
    case Tone::fault: break;
  }
  return "fault";
}

Headline headline(const StationState& state) {
  if (state.may_be_moving) return {Tone::fault, "KEEP CLEAR"};
  if (state.shutting_down || state.reloading) return {Tone::idle, "WAIT"};
  if (state.activity == Activity::stopping) {
    return {state.machine == MachineState::error ? Tone::fault : Tone::act, "STOPPING"};
  }
  if (state.activity == Activity::warning) return {Tone::act, "KEEP CLEAR"};
  switch (state.machine) {
    case MachineState::preoperational: return {Tone::idle, "WAIT"};
    case MachineState::halted: return {Tone::act, "RESET"};
    case MachineState::maintenance: return {Tone::act, state.activity == Activity::none ? "SERVICE" : "KEEP CLEAR"};
    case MachineState::error: return {Tone::fault, "FAULT"};
    case MachineState::initialized: return {Tone::working, "HOMING"};
    case MachineState::ready: return {Tone::ready, "READY"};
    case MachineState::single_execution:
    case MachineState::continuous_execution: break;
  }
  if (state.activity == Activity::waiting_for_part) return {Tone::act, "NEXT PART"};
  return state.job ? of_scan(state) : Headline{Tone::working, "WAIT"};
}

RemoteActions remote_actions(const StationState& state, const StationRules& rules) {
  const auto refusal = [&](Button button) {
    return next(state, event::Pressed{button, Origin::remote, {}}, rules).refused;
  };
  auto lend = next(state, event::ReloadRequested{.why = event::ReloadRequested::Why::lend}, rules);
  return {.start_refused = refusal(Button::start),
          .reset_refused = refusal(Button::reset),
          .setup_refused = std::move(lend.refused),
          .start_offer = start_offer(state)};
}

PanelOutputs lamps(const StationState& state, const JobTable& jobs, bool blink) {
  PanelOutputs out;
  const bool warning = state.activity == Activity::warning;
  const bool flip = state.activity == Activity::waiting_for_flip;
  const bool calibrates = state.job && state.job->recipe.is_calibration();
  out.red = state.machine == MachineState::error || state.may_be_moving || state.shutting_down;
  const bool part = state.activity == Activity::waiting_for_part;
  out.amber = (state.machine == MachineState::halted && !out.red) || warning || flip ||
              (state.machine == MachineState::maintenance && blink);
  out.busy = (state.activity != Activity::none && !flip && !part) || state.unclassified;
  out.green = state.machine == MachineState::ready || part ||
              (out.busy && !state.maintenance && !warning && !out.red && !out.amber);
  out.start_lamp = (state.machine == MachineState::ready && !calibration_problem(state)) || flip || part;
  out.flip_request = flip && !calibrates;
  const auto last = jobs.find(state.last_started_job);
  if (last != jobs.end() && is_final(last->second->state)) {
    out.pass = last->second->state == JobState::done && last->second->passed.value_or(true);
    out.fail = !out.pass;
  }
  return out;
}

}  // namespace scanrig
