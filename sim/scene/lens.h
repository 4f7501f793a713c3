#pragma once

#include <opencv2/core/mat.hpp>

#include "sim/scene/effects.h"

namespace scanrig::sim {

/// Blur and colours of one camera's lens: sigma grows from the centre to the corner, rays through the lens's rim and
/// along it are focused apart (astigmatism), red is imaged larger than blue.
/// Threads: const functions from any.
class Lens {
 public:
  /// `image_scale`: resolution as a share of the full sensor's; the blur is that of the full sensor.
  Lens(const Effects& effects, bool is_left, double image_scale);

  /// The light (32-bit float RGB, 1.0 = full scale) behind lens and colour filters (RGGB): one channel, 32-bit float.
  /// `extra_sigma_px`: blur of a lens out of focus besides, pixels of the full sensor.
  [[nodiscard]] cv::Mat image(const cv::Mat& light, double extra_sigma_px = 0.0) const;

  /// Sigma of the blur along the radius and across it, pixels of the full sensor, at `off`: the squared distance from
  /// the image's middle, in that of the corner.
  struct Blur {
    double radial, tangential;
  };
  [[nodiscard]] Blur blur(double off) const;

 private:
  double scale_, centre_, corner_, astigmatism_, chromatic_;
};

}  // namespace scanrig::sim
