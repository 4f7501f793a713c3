#pragma once

#include <filesystem>
#include <string>
#include <vector>

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

/// Every capture device among `nodes`/video*; serial numbers from udev's `nodes`/v4l/by-id.
std::vector<FoundCamera> find_v4l2_cameras(VideoCalls& calls, const std::filesystem::path& nodes = "/dev");

}  // namespace scanrig
