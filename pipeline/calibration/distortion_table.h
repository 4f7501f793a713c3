#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Camera::project() at a twentieth of its cost, for what looks up every texel: what the lens adds to a pinhole's
/// pixel, tabulated on a grid of 160 cells across the image. Within 1e-5 of the image's width of the camera. Immutable,
/// so any number of threads may use it.
class DistortionTable {
 public:
  /// The table reaches this far around the image, of its width: a lens pulls no more into it.
  static constexpr double kMargin = 0.15;

  explicit DistortionTable(const Camera& camera);

  /// The pixel that shows what a camera without distortion shows at `pinhole_pixel`.
  [[nodiscard]] Eigen::Vector2d distorted(const Eigen::Vector2d& pinhole_pixel) const;

 private:
  Eigen::Vector2d first_;  ///< pinhole pixel of the first node
  double stride_ = 0.0;    ///< px
  int columns_ = 0, rows_ = 0;
  std::vector<Eigen::Vector2d> added_;  ///< row by row
};

}  // namespace scanrig
