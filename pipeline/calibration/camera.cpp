#include "pipeline/calibration/camera.h"

namespace scanrig {

Eigen::Vector2d Camera::project(const Eigen::Vector3d& point_in_turntable) const {
  const Eigen::Vector3d p = camera_from_turntable * point_in_turntable;
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  return {projection.fx * xd + projection.cx, projection.fy * yd + projection.cy};
}

}  // namespace scanrig
