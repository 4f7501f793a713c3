#pragma once

#include <string>

#include "config/rig_config.h"

namespace scanrig::config {

/// The text of a rig.toml that read_rig_config() reads as `rig`: the chosen drivers with every key they need, a comment
/// where a person may want to change one. Paths are written as they are; `rig.turntable.profile_file` names the drive
/// profile. Left out, so at their defaults: quiet hours, webhook, board, limits of the recipes, packets, regions.
std::string rig_toml(const RigConfig& rig);

/// `found`, a text of rig_toml(), but with those tables of `present` that are not about devices, as they are written
/// there. Tables of devices: safety, turntable, projector, stereo_camera, panel, gpio.
std::string with_other_tables(const std::string& found, const std::string& present);

}  // namespace scanrig::config
