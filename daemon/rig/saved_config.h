#pragma once

#include <filesystem>

#include "config/rig_config.h"

namespace scanrig {

/// The configuration a daemon runs under, kept for whoever makes the rig safe when that daemon has died: rig.toml may
/// have been edited since, damaged or moved away. `rig.toml` in this folder, with its drive profile in `drives`.
/// For the daemon of `file`: in the folder that systemd makes for the service ($RUNTIME_DIRECTORY), without one beside
/// `file`.
std::filesystem::path saved_config_folder(const std::filesystem::path& file);

/// Before a device is used. Fails with `io`; then what was kept before is kept still.
Result<void> save_config(const config::RigConfig& config, const std::filesystem::path& folder);

}  // namespace scanrig
