#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/projector/projector.h"

namespace scanrig {

// Limits that hold for any rig; image_checker.cpp tells where they come from.
inline constexpr double kDarkImage = 0.02;   ///< brightness below which an image is dark: five grey values of 255
inline constexpr double kOverexposed = 0.1;  ///< saturated share of the pixels above which it is overexposed
inline constexpr double kOneImage = 0.25;    ///< left_right_correlation above which both sides show one image

/// Checks whether a pair can be what was exposed, by the values its driver measured. Compares them with limits that
/// hold for any rig, and with earlier pairs of the same job. Values that were not measured are not judged.
class ImageChecker {
 public:
  /// Starts another job: no images to compare with.
  void begin() { seen_.clear(); }

  /// Fails with `protocol`: an image is dark, overexposed or out of focus, or both sides show the same image.
  Result<void> judge(Light light, const StereoFrame& frame);

 private:
  struct Seen {
    std::vector<double> brightness, blur_px;  ///< of the images that passed, in ascending order
  };
  Result<void> judge(Light light, const char* side, const ImageQuality& evidence) const;
  void remember(Light light, const char* side, const ImageQuality& evidence);

  std::map<std::pair<Light, std::string>, Seen> seen_;
};

}  // namespace scanrig
