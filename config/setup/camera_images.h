#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/clock.h"
#include "drivers/camera/camera_list.h"

namespace scanrig::config::setup {

struct CameraImages {
  std::vector<std::string> files;  ///< one per camera; empty: none
  std::string trouble;             ///< why the last that has none has none
};

/// A JPEG file in `folder` of what each of these GigE or USB3 Vision cameras sees now, in their order: small, and
/// brightened for the eye. Cameras are exposed in pairs, by software.
CameraImages take_images(const std::vector<FoundCamera>& cameras, const std::string& pixel_format,
                         const std::filesystem::path& folder, Clock& clock);

}  // namespace scanrig::config::setup
