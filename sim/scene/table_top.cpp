#include "sim/scene/table_top.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/room_light.h"
#include "sim/scene/screen_colour.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kDotStep = 2.0 * std::numbers::pi / kRimDots;

/// `place` counts the dots; a whole turn more or less is the same dot.
Vector2d centre_at(int place) {
  const Profile& p = profile();
  const int dot = ((place % kRimDots) + kRimDots) % kRimDots;
  const double angle = kDotStep * (place + 0.25 * (uniform(mix(p.dot_seed, dot)) - 0.5));
  return p.rim_dot_radius_mm * Vector2d(std::sin(angle), std::cos(angle));
}

}  // namespace

Vector2d rim_dot_centre(int dot) { return centre_at(dot); }

double rim_dot_share(const Vector3d& in_table, double size, const RimDotErrors& errors) {
  const Profile& p = profile();
  const double radius = std::hypot(in_table.x(), in_table.z());
  if (std::abs(radius - p.rim_dot_radius_mm) > p.rim_dot_diameter_mm) return 0.0;
  const int nearest = static_cast<int>(std::lround(std::atan2(in_table.x(), in_table.z()) / kDotStep));
  const int dot = ((nearest % kRimDots) + kRimDots) % kRimDots;
  const Vector2d centre = centre_at(nearest) + errors[dot];
  const double inside = 0.5 * p.rim_dot_diameter_mm - (Vector2d(in_table.x(), in_table.z()) - centre).norm();
  return std::clamp(inside / std::max(size, 0.1) + 0.5, 0.0, 1.0);
}

Backdrop::Backdrop(ScreenColour colour) : albedo(on_screen(profile().backdrop_albedo, colour)) {
  const Vector3d aim(0.0, profile().aim_height_mm, 0.0);
  const double elevation = to_radians(profile().elevation_deg);
  normal = Vector3d(0.0, std::sin(elevation), std::cos(elevation));
  point = aim - profile().backdrop_distance_mm * normal;
}

Vector3f Backdrop::plain_light(const Vector3d& on_cloth) const {
  // Cloth lit a little less towards the sides and the floor.
  const double fall = (on_cloth - point).squaredNorm() / (300.0 * 300.0);
  const Surroundings free{Vector3f::Constant(0.8F), 1.0F};
  return static_cast<float>(1.0 - 0.25 * fall) *
         albedo.cwiseProduct(RoomLight::irradiance(free, Vector3d(0.0, 0.5, 0.87)));
}

}  // namespace scanrig::sim
