#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "drivers/camera/sensor_camera.h"
#include "drivers/camera/video_calls.h"

namespace scanrig {

struct V4l2SensorOptions {
  std::string serial;  ///< looked for among the names in /dev/v4l/by-id; empty: `device` is taken
  std::string device;  ///< such as /dev/scanrig/left
};

/// Two V4L2 capture devices, or one that delivers left and right image side by side.
struct V4l2Options {
  V4l2SensorOptions left;
  std::optional<V4l2SensorOptions> right;  ///< empty: `left` delivers both, left half first
  bool external_trigger = false;           ///< one frame per edge; otherwise the devices run freely
  std::string pixel_format = "GREY";       ///< V4L2's name: GREY Y10 Y12 Y16 YUYV RGGB GRBG GBRG BA81 MJPG ...
  cv::Size size{640, 480};                 ///< size of the images of one device
  std::chrono::microseconds exposure{12000};
  std::optional<int> gain;
  std::map<std::uint32_t, int> controls;  ///< more controls by id, such as a maker's trigger mode; set last
  std::chrono::milliseconds frame_timeout{500};
  std::filesystem::path by_id = "/dev/v4l/by-id";
};

/// Devices, opened by prepare() or arm(). See open_v4l2() for its errors.
std::unique_ptr<SensorCamera> v4l2_camera(const V4l2Options& options, VideoCalls& calls, Clock& clock);

/// Devices, opened and started. Fails with `not_found`, `io` (in use, access refused), `unsupported` (no capture
/// device, no such pixel format or size, time stamps that are not monotonic), `invalid_input` (a control's value that
/// the device rejects, or keeps another instead of: all are read back).
Result<std::unique_ptr<SensorCamera>> open_v4l2(const V4l2Options& options, VideoCalls& calls, Clock& clock,
                                                Deadline deadline);

}  // namespace scanrig
