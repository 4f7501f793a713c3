#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "pipeline/calibration/camera.h"

namespace scanrig {

/// OpenCV's lens model, as other programs have it: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 taux tauy, of which the first
/// `count` are not 0. Pixel centres at integers.
struct OpenCvLens {
  double fx = 1.0, fy = 1.0, cx = 0.0, cy = 0.0;
  std::array<double, 14> distortion{};
  std::size_t count = 5;

  /// Pixel of a point of the camera frame; z > 0.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& point_in_camera) const;
};

/// A lens in another program's model, and what that leaves over the image. 0: nothing, the model holds it.
struct LensFit {
  OpenCvLens lens;
  double rms_px = 0.0;
  double max_px = 0.0;
};

/// The camera's lens without its field is exact with five coefficients. With a field: least squares over the image, for
/// each of `counts` (ascending, 5 to 14); a larger count is taken when it lowers the rms by 2 %. Focal lengths and
/// centre take part, the pose does not. Threads: any. Same input, same bits.
LensFit fit_lens(const Camera& camera, std::span<const std::size_t> counts);

}  // namespace scanrig
