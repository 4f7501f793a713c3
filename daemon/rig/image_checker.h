#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "drivers/camera/stereo_camera.h"
#include "drivers/projector/projector.h"

namespace scanrig {

/// Says of a pair whether it can be what was exposed, by the evidence its driver measured: against limits that hold for
/// any rig, and against the pairs of the same job before it. What was not measured is not judged.
class ImageChecker {
 public:
  /// Another job: nothing is known of its pictures.
  void begin() { seen_.clear(); }

  /// Fails with `protocol`: a picture is dark, overexposed or out of focus, or both sides show the same picture.
  Result<void> judge(Light light, const StereoFrame& frame);

 private:
  struct Seen {
    std::vector<double> brightness, blur_px;  ///< of the pictures that passed, in ascending order
  };
  Result<void> judge(Light light, const char* side, const ImageQuality& evidence) const;
  void remember(Light light, const char* side, const ImageQuality& evidence);

  std::map<std::pair<Light, std::string>, Seen> seen_;
};

}  // namespace scanrig
