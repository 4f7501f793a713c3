#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/camera/video_calls.h"

namespace scanrig {

/// A camera that can be seen from this machine, whether or not it can be opened.
struct FoundCamera {
  std::string kind;    ///< "GigEVision", "USB3Vision", "V4L2"
  std::string name;    ///< maker and model
  std::string serial;  ///< for `serial` of rig.toml; empty if it tells none
  std::string where;   ///< IP address, or device node
};

/// Asks every network and USB port; takes about a second.
std::vector<FoundCamera> find_aravis_cameras();

/// Every capture device among `nodes`/video*; serial numbers as udev has them in `nodes`/v4l/by-id.
std::vector<FoundCamera> find_v4l2_cameras(VideoCalls& calls, const std::filesystem::path& nodes = "/dev");

}  // namespace scanrig
