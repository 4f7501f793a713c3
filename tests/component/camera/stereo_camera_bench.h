#pragma once

#include <functional>
#include <optional>

#include "core/clock.h"
#include "drivers/camera/stereo_camera.h"

namespace scanrig {

/// A stereo camera on the bench, with control of edges and frame faults. See stereo_camera_compliance.h.
class StereoCameraBench {
 public:
  enum class Fault { lost, late, torn, stale };

  virtual ~StereoCameraBench() = default;
  virtual StereoCamera& camera() = 0;
  virtual Clock& clock() = 0;

  /// Makes one exposure with the pattern on; returns its number, the one hidden in both frames.
  virtual std::uint64_t fire() = 0;
  /// Number hidden in an image of a StereoFrame; nothing if this bench hides none.
  virtual std::optional<std::uint64_t> number_in(const cv::Mat& image) = 0;
  /// Fault of the next exposure's frame of one sensor. False if this bench cannot make it.
  virtual bool spoil(Fault fault) = 0;
  /// Unplugs the camera, plugs it in again. False if this bench cannot do it.
  virtual bool plug(bool in) = 0;
  [[nodiscard]] virtual cv::Size size() const = 0;
  [[nodiscard]] virtual Clock::Duration ample() const { return std::chrono::seconds(10); }
};

}  // namespace scanrig
