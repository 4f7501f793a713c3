#pragma once

#include <filesystem>

#include "config/rig_config.h"
#include "core/clock.h"
#include "core/result.h"

namespace scanrig::ctl {

/// The configuration of a rig that no daemon has its hands on; a simulated camera may stand in it. Fails with `refused`
/// when a daemon listens at its socket, whether it answers or hangs, otherwise as read_rig_config().
Result<config::RigConfig> offline_rig_config(const std::filesystem::path& file);

/// True when the person at the terminal says yes to `question`, or `yes` was given on the command line.
bool agreed(const std::string& question, bool yes);

}  // namespace scanrig::ctl
