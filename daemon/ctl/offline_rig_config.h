#pragma once

#include <filesystem>

#include "config/rig_config.h"
#include "core/clock.h"
#include "core/result.h"

namespace scanrig::ctl {

/// The configuration of a rig that no daemon uses; it may name a simulated camera. Fails with `refused`
/// when a daemon listens at its socket, whether it responds or hangs, otherwise as read_rig_config().
Result<config::RigConfig> offline_rig_config(const std::filesystem::path& file);

/// True when the person at the terminal accepts `question`, or `yes` was given on the command line.
bool agreed(const std::string& question, bool yes);

}  // namespace scanrig::ctl
