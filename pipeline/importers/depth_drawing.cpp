#include "pipeline/importers/depth_drawing.h"

#include <algorithm>
#include <cmath>

namespace scanrig {

void draw_triangle(const std::array<Eigen::Vector3d, 3>& corners, const Projection& grid, cv::Mat1f& depth) {
  std::array<Eigen::Vector2d, 3> px;
  for (int k = 0; k < 3; ++k) px[k] = grid.project(corners[k]);
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  const double area = cross(px[1] - px[0], px[2] - px[0]);
  if (std::abs(area) < 1e-9) return;
  const Eigen::Vector2d low = px[0].cwiseMin(px[1]).cwiseMin(px[2]);
  const Eigen::Vector2d high = px[0].cwiseMax(px[1]).cwiseMax(px[2]);
  for (int v = static_cast<int>(std::ceil(low.y())); v <= static_cast<int>(std::floor(high.y())); ++v) {
    for (int u = static_cast<int>(std::ceil(low.x())); u <= static_cast<int>(std::floor(high.x())); ++u) {
      const Eigen::Vector2d p(u, v);
      const double w0 = cross(px[1] - p, px[2] - p) / area;
      const double w1 = cross(px[2] - p, px[0] - p) / area;
      const double w2 = 1.0 - w0 - w1;
      if (w0 < 0.0 || w1 < 0.0 || w2 < 0.0) continue;
      const auto z = static_cast<float>(w0 * corners[0].z() + w1 * corners[1].z() + w2 * corners[2].z());
      float& cell = depth(v, u);
      if (!(cell <= z)) cell = z;
    }
  }
}

}  // namespace scanrig
