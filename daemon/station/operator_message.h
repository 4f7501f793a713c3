#pragma once

#include <string>

#include "daemon/station/job_info.h"
#include "daemon/station/job_lifecycle.h"
#include "daemon/station/snapshot.h"
#include "daemon/station/transition.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Text for a person, on the panel, the page and the command line.
struct OperatorMessage {
  std::string sentence;     ///< what happens now
  std::string next_action;  ///< what the operator should do, if only to wait
};

/// The rig as a whole.
OperatorMessage describe(const StationState& state, const StationRules& rules);

/// One job: its state, the reason for it, and what to do about it.
OperatorMessage describe(const JobInfo& job);

/// The rig's state as it is read from afar.
Headline headline(const StationState& state);

/// What may be pressed remotely now.
RemoteActions remote_actions(const StationState& state, const StationRules& rules);

/// Next action when a pose is complete.
std::string how_to_flip(const Recipe& recipe, bool guard_closed = true);

/// Next action before a placement of the calibration board.
std::string how_to_place(const Placement& placement, bool guard_closed = true);

/// Meaning of the lamps. Red: fault. Amber: act now, or (with busy) keep your hands away. Green: ready or working.
/// Amber blinking (`blink` changes every half second): maintenance. Red also when the daemon ends.
/// The start lamp is on where Start would do something. Pass and fail show how the last started job ended;
/// both are off until then.
PanelOutputs lamps(const StationState& state, const JobTable& jobs, bool blink = false);

}  // namespace scanrig
