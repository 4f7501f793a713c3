#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/projector/projector.h"

namespace scanrig {

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
