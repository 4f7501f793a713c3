#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "drivers/camera/video_calls.h"

namespace scanrig {

/// A camera visible from this machine, even if it cannot be opened.
struct FoundCamera {
  std::string kind;    ///< "GigEVision", "USB3Vision", "V4L2"
  std::string name;    ///< maker and model
  std::string serial;  ///< for `serial` of rig.toml; empty if it has none
  std::string where;   ///< IP address, or device node
};

/// Searches every network and USB port; takes about a second.
std::vector<FoundCamera> find_aravis_cameras();

/// Settings that a camera can take, by their SFNC names.
struct CameraCapabilities {
  std::vector<std::string> pixel_formats;
  std::vector<std::string> trigger_sources;
};

/// Of a GigE or USB3 Vision camera, which is connected for that. Fails with `not_found`, `io` (in use, or gone).
Result<CameraCapabilities> aravis_capabilities(const std::string& serial);

/// Every capture device among `nodes`/video*; serial numbers from udev's `nodes`/v4l/by-id.
std::vector<FoundCamera> find_v4l2_cameras(VideoCalls& calls, const std::filesystem::path& nodes = "/dev");

}  // namespace scanrig
