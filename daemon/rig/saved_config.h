#pragma once

#include <filesystem>

#include "config/rig_config.h"

namespace scanrig {

/// The configuration a daemon runs under, saved for the process that makes the rig safe after the daemon's death.
/// rig.toml may have been edited since, damaged or moved. `rig.toml` in this folder, its drive profile in `drives`.
/// Folder for the daemon of `file`: the one that systemd makes for the service ($RUNTIME_DIRECTORY), otherwise beside
/// `file`.
std::filesystem::path saved_config_folder(const std::filesystem::path& file);

/// Saves before a device is used. Fails with `io`; then the older saved configuration remains.
Result<void> save_config(const config::RigConfig& config, const std::filesystem::path& folder);

}  // namespace scanrig
