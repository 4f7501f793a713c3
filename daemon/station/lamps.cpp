#include "daemon/station/lamps.h"

namespace scanrig {

PanelOutputs lamps(const StationState& state, const JobTable& jobs, bool blink) {
  PanelOutputs out;
  const bool warning = state.activity == Activity::warning;
  const bool flip = state.activity == Activity::waiting_for_flip;
  out.red = state.machine == MachineState::error || state.may_be_moving || state.shutting_down;
  const bool part = state.activity == Activity::waiting_for_part;
  out.amber = (state.machine == MachineState::halted && !out.red) || warning || flip ||
              (state.machine == MachineState::maintenance && blink);
  out.busy = (state.activity != Activity::none && !flip && !part) || state.unclassified;
  out.green = state.machine == MachineState::ready || part ||
              (out.busy && !state.maintenance && !warning && !out.red && !out.amber);
  out.start_lamp = state.machine == MachineState::ready || flip || part;
  out.flip_request = flip;
  const auto last = jobs.find(state.last_started_job);
  if (last != jobs.end() && is_final(last->second->state)) {
    out.pass = last->second->state == JobState::done && last->second->passed.value_or(true);
    out.fail = !out.pass;
  }
  return out;
}

}  // namespace scanrig
