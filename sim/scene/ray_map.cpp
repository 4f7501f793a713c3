#include "sim/scene/ray_map.h"

#include <cmath>

#include "core/parallel.h"

namespace scanrig::sim {

RayMap::RayMap(const Eye& eye) : across_(eye.width + 2), rays_(static_cast<std::size_t>(across_) * (eye.height + 2)) {
  parallel_for(static_cast<std::size_t>(eye.height + 2), [&](std::size_t row) {
    for (int i = 0; i < across_; ++i)
      rays_[row * across_ + i] = eye.ray(i - 1.0, static_cast<double>(row) - 1.0).head<2>();
  });
}

Eigen::Vector3d RayMap::ray(double u, double v) const {
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  const double fx = u - i, fy = v - j;
  const Eigen::Vector2d* r = &rays_[(j + 1) * across_ + i + 1];
  const Eigen::Vector2d at =
      (1.0 - fy) * ((1.0 - fx) * r[0] + fx * r[1]) + fy * ((1.0 - fx) * r[across_] + fx * r[across_ + 1]);
  return {at.x(), at.y(), 1.0};
}

}  // namespace scanrig::sim
