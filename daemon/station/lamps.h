#pragma once

#include "daemon/station/job_lifecycle.h"
#include "daemon/station/transition.h"
#include "drivers/panel/panel.h"

namespace scanrig {

/// What the lamps say. Red: fault. Amber: act now, or (with busy) keep your hands away. Green: ready or working.
/// Amber blinking (`blink` turns over every half second): maintenance. Red also when the daemon ends.
/// The start lamp burns where Start would do something. Pass and fail tell how the job of the part put on last ended;
/// neither burns until that is known.
PanelOutputs lamps(const StationState& state, const JobTable& jobs, bool blink = false);

}  // namespace scanrig
