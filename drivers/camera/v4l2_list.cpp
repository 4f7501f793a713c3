#include <linux/videodev2.h>

#include <algorithm>

#include "drivers/camera/camera_list.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

/// The serial number in usb-MAKER_MODEL_SERIAL-video-index0, which links to `node` [udev, 60-persistent-v4l.rules].
std::string serial_of(const fs::path& node, const fs::path& by_id) {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(by_id, none)) {
    if (fs::weakly_canonical(entry.path(), none) != fs::weakly_canonical(node, none)) continue;
    std::string name = entry.path().filename().string();
    name.resize(std::min(name.size(), name.rfind("-video-index")));
    const auto begin = name.rfind('_');
    return begin == std::string::npos ? "" : name.substr(begin + 1);
  }
  return "";
}

std::vector<fs::path> video_nodes(const fs::path& nodes) {
  std::vector<fs::path> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(nodes, none)) {
    if (entry.path().filename().string().starts_with("video")) found.push_back(entry.path());
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace

std::vector<FoundCamera> find_v4l2_cameras(VideoCalls& calls, const fs::path& nodes) {
  std::vector<FoundCamera> found;
  for (const auto& node : video_nodes(nodes)) {
    const int descriptor = calls.open(node.string());
    if (descriptor < 0) {
      found.push_back({"V4L2", "cannot be opened: in use, or access refused", "", node.string()});
      continue;
    }
    v4l2_capability capability{};
    const bool told = calls.control(descriptor, VIDIOC_QUERYCAP, &capability) == 0;
    calls.close(descriptor);
    const auto can = capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
    if (!told || !(can & V4L2_CAP_VIDEO_CAPTURE)) continue;
    found.push_back({"V4L2", reinterpret_cast<const char*>(capability.card), serial_of(node, nodes / "v4l" / "by-id"),
                     node.string()});
  }
  return found;
}

}  // namespace scanrig
