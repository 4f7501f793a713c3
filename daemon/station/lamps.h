#pragma once

#include "daemon/station/job_lifecycle.h"
#include "daemon/station/transition.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// Meaning of the lamps. Red: fault. Amber: act now, or (with busy) keep your hands away. Green: ready or working.
/// Amber blinking (`blink` changes every half second): maintenance. Red also when the daemon ends.
/// The start lamp is on where Start would do something. Pass and fail show how the last started job ended;
/// both are off until then.
PanelOutputs lamps(const StationState& state, const JobTable& jobs, bool blink = false);

}  // namespace scanrig
