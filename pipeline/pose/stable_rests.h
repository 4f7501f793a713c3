#pragma once

#include <span>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/pose/convex_hull.h"

namespace scanrig {

/// A plane on which the solid is stable: n.x = offset, n the unit outward normal; no point of the solid lies beyond it.
struct StableRest {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset_mm = 0.0;
  double height_mm = 0.0;  ///< of the solid when it rests there
  double margin_mm = 0.0;  ///< from the centre of mass to the nearest edge of the support, negative outside it
};

struct StableRestOptions {
  double support_tolerance_mm = 3.0;  ///< `egi`: the paper's delta_I
  double height_tolerance_mm = 3.0;   ///< `egi`: the paper's delta_H
  double flatness = 0.004;            ///< `hull`: supports lie this close to the plane, as a share of the solid's size
  double dilation_mm = 2.0;           ///< the support is widened by this, or by `dilation`: the models are partial
  double dilation = 0.03;             ///< share of the solid's size
  double apart_deg = 5.0;             ///< rests closer than this are one; neighbours farther apart are kept
};

/// Number of planes left after each of the paper's tests; for its example 186 -> 141 -> 18 -> 9.
struct RestCounts {
  int tangent_planes = 0;
  int after_base_plane = 0;
  int after_stability = 0;
  int after_height = 0;
};

struct StableRests {
  std::vector<StableRest> rests;  ///< most stable first
  RestCounts counts;
};

/// Rests by the facets of the convex hull, merged where coplanar: a facet is a rest if the centre of mass projects into
/// it [exact form of Park and Subbarao 2002, 3.2]. `other_height_mm` is the height of the object in the other pose; it
/// is only counted here (`after_height`), since a hard gate loses true rests of partial models.
Result<StableRests> rests_on_hull(const Mesh& solid, const SolidProperties& properties, double other_height_mm,
                                  const StableRestOptions& options);

/// Rests by the Extended Gaussian Image, one tangent plane for each of the 320 faces of a tessellated sphere, through
/// the three tests as published [Park and Subbarao 2002, 3.2].
Result<StableRests> rests_on_sphere(const Mesh& solid, const SolidProperties& properties, double other_height_mm,
                                    const StableRestOptions& options);

/// Distance from the foot of `point` on the plane with `normal` to the nearest edge of the convex hull of the feet of
/// `supports`; negative outside. It decides whether a rest is stable.
double support_margin(std::span<const Eigen::Vector3d> supports, const Eigen::Vector3d& normal,
                      const Eigen::Vector3d& point);

/// The first of each bunch of rests whose normals are within `apart_deg`; of these the most stable first.
std::vector<StableRest> distinct(const std::vector<StableRest>& rests, double apart_deg);

}  // namespace scanrig
