#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "pipeline/pose/stable_rests.h"

namespace scanrig {

Result<StableRests> rests_on_hull(const Mesh& solid, const SolidFacts& facts, double other_height_mm,
                                  const StableRestOptions& options) {
  const auto hull = convex_hull(solid.vertices);
  if (!hull) return pass_on(hull, "stable rests");
  const double dilation = std::max(options.dilation_mm, options.dilation * facts.size_mm);
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector3f& v : hull->vertices) corners.push_back(v.cast<double>());

  // A facet stands for all facets that are coplanar with it: its supports are all corners close to its plane.
  std::vector<StableRest> candidates(hull->faces.size());
  parallel_for(hull->faces.size(), [&](std::size_t f) {
    const auto& face = hull->faces[f];
    const Eigen::Vector3d& a = corners[face[0]];
    const Eigen::Vector3d area = (corners[face[1]] - a).cross(corners[face[2]] - a);
    StableRest& rest = candidates[f];
    if (area.norm() < 1e-9) return;  // a sliver has no normal; margin 0 and normal 0 mark it
    rest.normal = area.normalized();
    rest.offset_mm = -1e300;
    double lowest = 1e300;
    for (const Eigen::Vector3d& c : corners) {
      rest.offset_mm = std::max(rest.offset_mm, rest.normal.dot(c));
      lowest = std::min(lowest, rest.normal.dot(c));
    }
    rest.height_mm = rest.offset_mm - lowest;
    std::vector<Eigen::Vector3d> supports;
    for (const Eigen::Vector3d& c : corners) {
      if (rest.normal.dot(c) > rest.offset_mm - options.flatness * facts.size_mm) supports.push_back(c);
    }
    rest.margin_mm = support_margin(supports, rest.normal, facts.centre_of_mass);
  });
  std::erase_if(candidates, [](const StableRest& rest) { return rest.normal.isZero(); });

  StableRests found;
  found.counts.tangent_planes = found.counts.after_base_plane = static_cast<int>(candidates.size());
  std::erase_if(candidates, [&](const StableRest& rest) { return rest.margin_mm < -dilation; });
  found.rests = distinct(std::move(candidates), options.apart_deg);
  found.counts.after_stability = static_cast<int>(found.rests.size());
  found.counts.after_height = static_cast<int>(std::ranges::count_if(found.rests, [&](const StableRest& rest) {
    return std::abs(rest.height_mm - other_height_mm) < options.height_tolerance_mm;
  }));
  return found;
}

}  // namespace scanrig
