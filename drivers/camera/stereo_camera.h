#pragma once

#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <string>
#include <tuple>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig {

/// Layout of a frame's bytes. `bayer_rggb8`: one byte per pixel, red at (0,0).
enum class PixelFormat { mono8, bayer_rggb8, bgr8 };

/// Name used in manifests: "Mono8", "BayerRG8", "BGR8" (GenICam PFNC).
std::string to_string(PixelFormat format);

/// Quality of an image, independent of its content; NaN where the driver does not measure it.
struct ImageQuality {
  double brightness = std::numeric_limits<double>::quiet_NaN();  ///< mean grey value, 0 to 1
  double saturated = std::numeric_limits<double>::quiet_NaN();   ///< share of the pixels at full scale, 0 to 1
  double blur_px =
      std::numeric_limits<double>::quiet_NaN();  ///< standard deviation of the blur of fine texture, pixels
};

/// Two images of one moment, as the sensors delivered them.
struct StereoFrame {
  cv::Mat left;   ///< 8 bit; 1 channel for mono8 and bayer_rggb8, 3 for bgr8
  cv::Mat right;  ///< same size and type as `left`
  PixelFormat format = PixelFormat::mono8;
  std::uint64_t trigger = 0;  ///< number of triggers since arm(), including this one
  Clock::TimePoint taken;
  ImageQuality left_evidence = {};
  ImageQuality right_evidence = {};
  /// Correlation of the fine texture at the same places of both images, upper quartile of the rows: near 1 when both
  /// show one image, near 0 for two viewpoints; NaN where it is not measured.
  double left_right_correlation = std::numeric_limits<double>::quiet_NaN();
};

/// Two synchronised sensors, bound by serial number, triggered by the projector's edge.
/// One arm(), one edge, one collect(): nothing older than the trigger is ever returned.
/// Threads: one owner.
class StereoCamera {
 public:
  virtual ~StereoCamera() = default;

  /// Connects, sets up and warms up the camera. Reconnects a lost camera. Makes the exposures that the next arm() would
  /// otherwise make and discard. A loss while idle is noticed within seconds. Between arm() and collect() prepare()
  /// exposes nothing.
  /// Fails with `not_found`, `timeout`, `io`, `protocol`, and with `unsupported`, `invalid_input` for a camera that
  /// differs from its configuration.
  virtual Result<void> prepare(Deadline deadline) = 0;

  /// Makes both sensors wait for the next edge; frames still in flight are discarded.
  /// Fails with `timeout`, `protocol`, `io`.
  virtual Result<void> arm(Deadline deadline) = 0;

  /// Every exposure from the next arm() on lasts `factor` times the configured time, after a reconnection too, until
  /// this is called again. Not between arm() and collect(). Fails with `unsupported` (the device has no other exposures
  /// than the configured one), `invalid_input` (it refuses this one), `io`, `timeout`; then the time is unknown.
  virtual Result<void> scale_exposure(double factor, Deadline deadline) {
    std::ignore = deadline;
    if (factor == 1.0) return {};
    return fail(ErrorCode::unsupported, "camera: has one exposure only; leave pattern_exposures_us out");
  }

  /// The pair that belongs to the edge after arm(). Fails with `timeout` (a frame is missing), `protocol` (torn, or the
  /// two frames do not belong together), `io`. After a failure, arm() again and repeat the exposure.
  virtual Result<StereoFrame> collect(Deadline deadline) = 0;

  /// Takes a pair without an edge, in the present light, for preview only: left and right may be two moments. Ends what
  /// arm() started. Fails as arm() and collect(), and with `unsupported` where only an edge exposes.
  virtual Result<StereoFrame> capture_preview(Deadline deadline) = 0;
};

}  // namespace scanrig
