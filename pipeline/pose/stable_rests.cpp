#include "pipeline/pose/stable_rests.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.h"

namespace scanrig {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Counter-clockwise convex polygon around `points` (Andrew's monotone chain).
std::vector<Eigen::Vector2d> convex_polygon(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2d> polygon;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = polygon.size();
    for (const Eigen::Vector2d& p : points) {
      while (polygon.size() >= start + 2 &&
             cross(polygon.back() - polygon[polygon.size() - 2], p - polygon.back()) <= 0.0) {
        polygon.pop_back();
      }
      polygon.push_back(p);
    }
    polygon.pop_back();  // the first of the other chain
    std::reverse(points.begin(), points.end());
  }
  return polygon;
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double length = (b - a).squaredNorm();
  const double t = length > 0.0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0.0;
  return (p - a - t * (b - a)).norm();
}

}  // namespace

double support_margin(std::span<const Eigen::Vector3d> supports, const Eigen::Vector3d& normal,
                      const Eigen::Vector3d& point) {
  const Eigen::Vector3d e1 = normal.unitOrthogonal();
  const Eigen::Vector3d e2 = normal.cross(e1);
  std::vector<Eigen::Vector2d> feet;
  for (const Eigen::Vector3d& s : supports) feet.emplace_back(e1.dot(s), e2.dot(s));
  const Eigen::Vector2d foot(e1.dot(point), e2.dot(point));
  if (feet.size() == 1) return -(foot - feet[0]).norm();
  const auto polygon = convex_polygon(std::move(feet));
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = polygon.size() >= 3;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Eigen::Vector2d& a = polygon[k];
    const Eigen::Vector2d& b = polygon[(k + 1) % polygon.size()];
    nearest = std::min(nearest, distance_to_segment(foot, a, b));
    inside = inside && cross(b - a, foot - a) >= 0.0;
  }
  return inside ? nearest : -nearest;
}

std::vector<StableRest> distinct(const std::vector<StableRest>& rests, double apart_deg) {
  const double same = std::cos(to_radians(apart_deg));
  std::vector<StableRest> kept;
  for (const StableRest& rest : rests) {
    const bool is_known =
        std::any_of(kept.begin(), kept.end(), [&](const StableRest& k) { return k.normal.dot(rest.normal) > same; });
    if (!is_known) kept.push_back(rest);
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const StableRest& a, const StableRest& b) { return a.margin_mm > b.margin_mm; });
  return kept;
}

}  // namespace scanrig
