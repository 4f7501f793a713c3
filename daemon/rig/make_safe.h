#pragma once

#include "config/rig_config.h"
#include "core/clock.h"

namespace scanrig {

/// What could be reached when the rig was made safe.
struct MadeSafe {
  Result<void> turntable;  ///< seen standing; otherwise the table may be moving
  Result<void> projector;  ///< told to be dark
  Result<void> panel;      ///< shows red
};

/// Stop, light off, red lamp, all at once and each again and again until it has succeeded or `deadline` has passed: the
/// daemon that had the devices may have died a moment ago. May be done twice.
MadeSafe make_safe(const config::RigConfig& config, Clock& clock, Deadline deadline);

/// For systemd's ExecStopPost=: within a second, with a line on standard error for what was not reached.
/// `ok`, `device` (the table may be moving), `partly_safe` (it stands, but light or lamp were not reached),
/// `bad_input`.
ExitCode make_safe_now(const Result<config::RigConfig>& config, const char* program);

}  // namespace scanrig
