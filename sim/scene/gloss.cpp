#include "sim/scene/gloss.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanrig::sim {

using Eigen::Vector3d;

namespace {

double schlick(double f0, double cosine) { return f0 + (1.0 - f0) * std::pow(1.0 - std::clamp(cosine, 0.0, 1.0), 5.0); }

}  // namespace

double ggx_density(double alpha, double cosine) {
  const double a2 = alpha * alpha, d = cosine * cosine * (a2 - 1.0) + 1.0;
  return a2 / (std::numbers::pi * d * d);
}

double Gloss::towards(const Vector3d& normal, const Vector3d& to_eye, const Vector3d& to_light) const {
  const double nv = normal.dot(to_eye), nl = normal.dot(to_light);
  if (normal_reflectance <= 0.0 || nv <= 0.0 || nl <= 0.0) return 0.0;
  const Vector3d half = (to_eye + to_light).normalized();
  const double a2 = alpha * alpha;
  const double masked = nl * std::sqrt(nv * nv * (1.0 - a2) + a2) + nv * std::sqrt(nl * nl * (1.0 - a2) + a2);
  const double lobe = ggx_density(alpha, normal.dot(half)) * 0.5 / masked;
  return std::numbers::pi * lobe * schlick(normal_reflectance, half.dot(to_eye));
}

Gloss Gloss::widened(double half_angle) const {
  // A mirrored direction moves by twice the facet's angle.
  return {std::min(1.0, std::hypot(alpha, 0.5 * half_angle)), normal_reflectance};
}

double Gloss::mirrored(double cosine) const {
  // A rough surface has no bright rim: its facets do not lie as flat as it does.
  return normal_reflectance + (1.0 - alpha) * (schlick(normal_reflectance, cosine) - normal_reflectance);
}

}  // namespace scanrig::sim
