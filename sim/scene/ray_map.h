#pragma once

#include <vector>

#include "sim/scene/optics.h"

namespace scanrig::sim {

/// Directions of an eye's pixels, tabulated: a lens is inverted once per pixel instead of once per sample. Between
/// pixels bilinear, off by less than 1e-5 px. Threads: const functions from any.
class RayMap {
 public:
  explicit RayMap(const Eye& eye);

  /// Direction in the eye's frame, z = 1, of a place less than half a pixel outside the image at most.
  [[nodiscard]] Eigen::Vector3d ray(double u, double v) const;

 private:
  int across_ = 0;
  std::vector<Eigen::Vector2d> rays_;  // from pixel (-1, -1)
};

}  // namespace scanrig::sim
