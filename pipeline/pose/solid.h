#pragma once

#include <span>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// What pose estimation needs to know of a solid bounded by a closed mesh.
struct SolidFacts {
  double volume_mm3 = 0.0;
  Eigen::Vector3d centre_of_mass = Eigen::Vector3d::Zero();  ///< of the solid filled evenly, not of its vertices
  double size_mm = 0.0;                                      ///< diagonal of the box around it
};

/// By the divergence theorem. Fails with `not_closed` (an edge without its opposite), `degenerate` (no volume, or
/// inside out).
Result<SolidFacts> solid_facts(const Mesh& solid);

/// The farthest reach of the points along `direction` (unit): max n.v.
double reach_along(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& direction);

/// A convex hull as triangles, counter-clockwise seen from outside; vertices are the hull's own only.
/// Fails with `degenerate` (fewer than four points, or all in one plane).
Result<Mesh> convex_hull(std::span<const Eigen::Vector3f> points);

}  // namespace scanrig
