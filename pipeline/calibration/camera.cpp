#include "pipeline/calibration/camera.h"

#include <Eigen/LU>
#include <cmath>

namespace scanrig {
namespace {

/// One step of Newton's for the point of the plane z = 1 that Brown's coefficients carry to `target`.
Eigen::Vector2d newton_step(const std::array<double, 5>& distortion, const Eigen::Vector2d& p,
                            const Eigen::Vector2d& target) {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3));
  const Eigen::Vector2d miss(x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) - target.x(),
                             y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y - target.y());
  Eigen::Matrix2d jacobian;
  jacobian(0, 0) = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
  jacobian(0, 1) = jacobian(1, 0) = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
  jacobian(1, 1) = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return p - jacobian.inverse() * miss;
}

}  // namespace

Eigen::Vector2d Camera::project(const Eigen::Vector3d& point_in_turntable) const {
  const Eigen::Vector3d p = camera_from_turntable * point_in_turntable;
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  const Eigen::Vector2d pixel(projection.fx * xd + projection.cx, projection.fy * yd + projection.cy);
  if (!lens_field) return pixel;
  return pixel + lens_field->at(pixel);
}

Eigen::Vector3d Camera::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d source = lens_field ? lens_field->source_of(pixel) : pixel;
  const double xd = (source.x() - projection.cx) / projection.fx;
  const double yd = (source.y() - projection.cy) / projection.fy;
  const auto& [k1, k2, p1, p2, k3] = distortion;
  double x = xd;
  double y = yd;
  // Fixed point of the distortion; contracts by the distortion's own size, so 1e-12 after a few rounds.
  for (int round = 0; round < 20; ++round) {
    const double r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double nx = (xd - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial;
    const double ny = (yd - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial;
    const double change = std::abs(nx - x) + std::abs(ny - y);
    x = nx;
    y = ny;
    if (change < 1e-10) break;
  }
  if (!lens_field) return {x, y, 1.0};
  return newton_step(distortion, {x, y}, {xd, yd}).homogeneous();
}

bool is_of_cameras(const Calibration& calibration, const std::string& left, const std::string& right) {
  const auto may_be = [](const std::string& own, const std::string& other) {
    return own.empty() || other.empty() || own == other;
  };
  return may_be(calibration.left.serial, left) && may_be(calibration.right.serial, right);
}

}  // namespace scanrig
