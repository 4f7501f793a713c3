#pragma once

#include <span>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The farthest reach of the points along `direction` (unit): max n.v.
double reach_along(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& direction);

/// A convex hull as triangles, counter-clockwise seen from outside; vertices are the hull's own only.
/// Fails with `degenerate` (fewer than four points, or all in one plane).
Result<Mesh> convex_hull(std::span<const Eigen::Vector3f> points);

}  // namespace scanrig
