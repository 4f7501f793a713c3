#include "sim/scene/lamp.h"

#include <algorithm>
#include <cmath>

namespace scanrig::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

Lamp::Lamp(const Eye& projector, const DotPattern& dots, const Effects& effects, double finger)
    : projector_(projector),
      dots_(dots),
      black_(effects.projector_black),
      falloff_(effects.falloff),
      rounding_(effects.dot_rounding_px),
      finger_(finger),
      place_(projector.centre()),
      focus_((projector.eye_from_turntable * Vector3d(0.0, profile().aim_height_mm, 0.0)).z()) {}

Lamp::Beam Lamp::beam(const Vector3d& point, double sigma_mm) const {
  const Profile& p = profile();
  const Vector3d q = projector_.eye_from_turntable * point;
  const double u = projector_.fx * q.x() / q.z() + projector_.cx, v = projector_.fy * q.y() / q.z() + projector_.cy;
  const double defocus = p.projector_defocus_px_per_mm * std::abs(q.z() - focus_);
  const double averaged = sigma_mm * projector_.fx / q.z();
  double sigma = std::hypot(p.projector_sigma_px, defocus, averaged);
  if (rounding_ > 0.0) sigma = std::hypot(sigma, rounding_);
  return {u, v, q.z(), sigma};
}

double Lamp::irradiance(const Beam& b, double cosine) const {
  const double dots = black_ + (1.0 - black_) * dots_.brightness(b.u, b.v, b.sigma);
  const double light = profile().projector_light * dots * cosine * std::pow(focus_ / b.depth, 2.0);
  return falloff_ > 0.0 || finger_ > 0.0 ? light * strength(b) : light;
}

double Lamp::mean_irradiance(const Beam& b, double cosine) const {
  const bool is_inside = b.u > 0.0 && b.v > 0.0 && b.u < projector_.width - 1.0 && b.v < projector_.height - 1.0;
  const double dots = black_ + (is_inside ? (1.0 - black_) * profile().dot_coverage : 0.0);
  return profile().projector_light * dots * cosine * std::pow(focus_ / b.depth, 2.0) * strength(b);
}

double Lamp::strength(const Beam& b) const {
  const Vector2d from_middle((b.u - projector_.cx) / (0.5 * projector_.width),
                             (b.v - projector_.cy) / (0.5 * projector_.height));
  const double even = 1.0 - falloff_ * std::min(1.0, 0.5 * from_middle.squaredNorm());
  if (finger_ == 0.0) return even;
  // A finger that comes into the beam from below at the right: near the lamp, so its edge is soft.
  constexpr double kHalfWidth = 70.0, kSoft = 40.0;  // projector pixels, assumed
  const Vector2d tip(1060.0, 560.0), towards = Vector2d(0.5, 1.0).normalized(), at = Vector2d(b.u, b.v) - tip;
  const double along = std::max(0.0, at.dot(towards));
  const double inside = std::clamp(0.5 + (kHalfWidth - (at - along * towards).norm()) / kSoft, 0.0, 1.0);
  return even * (1.0 - finger_ * inside);
}

}  // namespace scanrig::sim
