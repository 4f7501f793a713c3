#pragma once

#include <filesystem>

#include "config/rig_config.h"
#include "config/section.h"

namespace scanrig::config {

/// [stereo_camera]; relative paths start at `base`.
void read_stereo_camera(Section& s, const std::filesystem::path& base, Cameras cameras, StereoCameraConfig& camera);

}  // namespace scanrig::config
