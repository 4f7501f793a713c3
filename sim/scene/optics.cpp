#include "sim/scene/optics.h"

#include <cmath>
#include <numbers>

#include "core/units.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d distort(const std::array<double, 5>& k, const Vector2d& p) {
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

Eye camera(const Profile& p, bool left, double scale) {
  Eye eye;
  eye.serial = left ? "SIM-L" : "SIM-R";
  eye.width = static_cast<int>(std::lround(p.width * scale));
  eye.height = static_cast<int>(std::lround(p.height * scale));
  eye.fx = eye.fy = (p.focal_px + (left ? -0.5 : 0.5) * p.focal_difference_px) * scale;
  const double* principal = left ? p.principal_left_px : p.principal_right_px;
  eye.cx = (principal[0] + 0.5) * scale - 0.5;
  eye.cy = (principal[1] + 0.5) * scale - 0.5;
  const double* k = left ? p.distortion_left : p.distortion_right;
  eye.distortion = {k[0], k[1], k[2], k[3], k[4]};
  return eye;
}

/// cos(i pi x) for i = 0 to 3.
Eigen::Vector4d cosines(double x) {
  const double c = std::cos(std::numbers::pi * x);
  return {1.0, c, 2.0 * c * c - 1.0, c * (4.0 * c * c - 3.0)};
}

}  // namespace

Vector2d LensResidual::at(double x, double y) const {
  const Eigen::Vector4d along_x = cosines(x), along_y = cosines(y);
  return {along_x.dot(du * along_y), along_x.dot(dv * along_y)};
}

Transform looking_at(const Vector3d& centre, const Vector3d& target) {
  const Vector3d forward = (target - centre).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitY()).normalized();
  Transform eye_from_turntable = Transform::Identity();
  eye_from_turntable.linear().row(0) = right;
  eye_from_turntable.linear().row(1) = forward.cross(right);
  eye_from_turntable.linear().row(2) = forward;
  eye_from_turntable.translation() = -(eye_from_turntable.linear() * centre);
  return eye_from_turntable;
}

Vector2d Eye::project(const Vector3d& point_in_turntable) const {
  const Vector3d q = eye_from_turntable * point_in_turntable;
  const Vector2d d = distort(distortion, {q.x() / q.z(), q.y() / q.z()});
  const Vector2d pixel(fx * d.x() + cx, fy * d.y() + cy);
  return residual ? Vector2d(pixel + residual->at((pixel.x() + 0.5) / width, (pixel.y() + 0.5) / height)) : pixel;
}

Vector3d Eye::ray(double u, double v) const {
  if (residual) {
    Vector2d pixel(u, v);  // of Brown's model
    for (int i = 0; i < 3; ++i)
      pixel = Vector2d(u, v) - residual->at((pixel.x() + 0.5) / width, (pixel.y() + 0.5) / height);
    u = pixel.x(), v = pixel.y();
  }
  const Vector2d target((u - cx) / fx, (v - cy) / fy);
  Vector2d p = target;
  // The distortion is mild (it moves a corner by 0.3 %), so the fixed point gains two or more digits per step.
  for (int i = 0; i < 6; ++i) p += target - distort(distortion, p);
  return {p.x(), p.y(), 1.0};
}

RigGeometry default_rig(double image_scale) {
  const Profile& p = profile();
  const Vector3d aim(0.0, p.aim_height_mm, 0.0);
  const double elevation = to_radians(p.elevation_deg);
  const Vector3d middle = aim + p.distance_mm * Vector3d(0.0, std::sin(elevation), std::cos(elevation));
  const Vector3d half(0.5 * p.baseline_mm, 0.0, 0.0);
  RigGeometry rig{camera(p, true, image_scale), camera(p, false, image_scale), Eye{}};
  rig.left.eye_from_turntable = looking_at(middle - half, aim);
  rig.right.eye_from_turntable = looking_at(middle + half, aim);
  rig.projector.width = p.projector_width;
  rig.projector.height = p.projector_height;
  rig.projector.fx = rig.projector.fy = p.projector_focal_px;
  rig.projector.cx = 0.5 * (p.projector_width - 1);
  rig.projector.cy = 0.5 * (p.projector_height - 1);
  rig.projector.eye_from_turntable = looking_at(middle + Vector3d(0.0, p.projector_above_mm, 0.0), aim);
  return rig;
}

}  // namespace scanrig::sim
