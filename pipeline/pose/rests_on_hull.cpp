#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/pose/stable_rests.h"

namespace scanrig {
namespace {

/// Normals of the hull's facets, the largest first; a facet within 1.5 deg of a larger one is merged into it.
std::vector<StableRest> facet_directions(const std::vector<Mesh::Face>& faces,
                                         const std::vector<Eigen::Vector3d>& corners) {
  std::vector<Eigen::Vector3d> areas;
  for (const Mesh::Face& face : faces) {
    const Eigen::Vector3d& a = corners[face[0]];
    const Eigen::Vector3d area = (corners[face[1]] - a).cross(corners[face[2]] - a);
    if (area.norm() > 1e-9) areas.push_back(area);  // a sliver has no normal
  }
  std::stable_sort(areas.begin(), areas.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.squaredNorm() > b.squaredNorm();
  });
  const double merged = std::cos(to_radians(1.5));
  std::vector<StableRest> directions;
  for (const Eigen::Vector3d& area : areas) {
    const Eigen::Vector3d normal = area.normalized();
    const bool is_known =
        std::ranges::any_of(directions, [&](const StableRest& d) { return d.normal.dot(normal) > merged; });
    if (!is_known) directions.push_back({.normal = normal});
  }
  return directions;
}

}  // namespace

Result<StableRests> rests_on_hull(const Mesh& solid, const SolidProperties& properties, double other_height_mm,
                                  const StableRestOptions& options) {
  const auto hull = convex_hull(solid.vertices);
  if (!hull) return pass_on(hull, "stable rests");
  const double dilation = std::max(options.dilation_mm, options.dilation * properties.size_mm);
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector3f& v : hull->vertices) corners.push_back(v.cast<double>());

  std::vector<StableRest> candidates = facet_directions(hull->faces, corners);
  parallel_for(candidates.size(), [&](std::size_t f) {
    StableRest& rest = candidates[f];
    rest.offset_mm = reach_along(hull->vertices, rest.normal);
    rest.height_mm = rest.offset_mm + reach_along(hull->vertices, -rest.normal);
    std::vector<Eigen::Vector3d> supports;
    for (const Eigen::Vector3d& c : corners) {
      if (rest.normal.dot(c) > rest.offset_mm - options.flatness * properties.size_mm) supports.push_back(c);
    }
    rest.margin_mm = support_margin(supports, rest.normal, properties.centre_of_mass);
  });

  StableRests found;
  found.counts.tangent_planes = found.counts.after_base_plane = static_cast<int>(candidates.size());
  std::erase_if(candidates, [&](const StableRest& rest) { return rest.margin_mm < -dilation; });
  found.rests = distinct(candidates, options.apart_deg);  // of neighbours the largest facet is the contact
  found.counts.after_stability = static_cast<int>(found.rests.size());
  found.counts.after_height = static_cast<int>(std::ranges::count_if(found.rests, [&](const StableRest& rest) {
    return std::abs(rest.height_mm - other_height_mm) < options.height_tolerance_mm;
  }));
  return found;
}

}  // namespace scanrig
