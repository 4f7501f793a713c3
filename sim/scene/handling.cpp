#include "sim/scene/handling.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "sim/scene/random.h"

namespace scanrig::sim {

using Eigen::Vector3d;

namespace {

constexpr std::uint64_t kHandled = 0x68616e64;

}  // namespace

Handling Handling::all(const Effects& e) {
  return {e.creep_mm, e.rock_deg, e.finger, e.overexposed, e.sticker, e.shadow};
}

Handling Handling::of_view(const Effects& e, std::uint64_t seed, int views, int pose, double angle_deg) {
  if (pose != 0 || views < 2) return {};
  const double step = 360.0 / views;
  const auto chosen = 1.0 + static_cast<double>(mix(seed, kHandled) % static_cast<std::uint64_t>(views - 1));
  if (std::abs(std::remainder(angle_deg - chosen * step, 360.0)) > 0.25 * step) return {};
  return all(e);
}

Transform Handling::moved(const Transform& table_from_object) const {
  if (creep_mm == 0.0 && rock_deg == 0.0) return table_from_object;
  return small_motion({to_radians(rock_deg), 0.0, 0.0}, {creep_mm, 0.0, 0.0}) * table_from_object;
}

float Handling::patch(const Vector3d& in_object, const Vector3d& spot, double reach) {
  constexpr double kSoft = 0.5;  // mm
  return static_cast<float>(std::clamp((reach - (in_object - spot).norm()) / kSoft + 0.5, 0.0, 1.0));
}

}  // namespace scanrig::sim
