#pragma once

#include <vector>

#include "pipeline/mesh/mesh.h"
#include "tests/unit/pipeline/pose/turned_solids.h"

/// Solids by signed distance, more of them than unit tests need, and their meshes.
namespace scanrig::campaign {

/// Signed distance in mm, negative inside; nowhere more than the distance to the surface.
using Distance = testing::Solid;
using testing::ball;
using testing::block;
using testing::lathed;

/// A cylinder from `a` to `b`.
Distance rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Balls of `radii` along the polyline `points`, and all between them.
Distance chain(std::vector<Eigen::Vector3d> points, std::vector<double> radii);
/// A ring about `axis`.
Distance ring(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double radius, double thickness);
/// All points with normal.x <= offset.
Distance half_space(const Eigen::Vector3d& normal, double offset);

Distance united(std::vector<Distance> parts);
/// United with fillets of about `fillet_mm`.
Distance blended(std::vector<Distance> parts, double fillet_mm);
Distance without(Distance solid, Distance hole);
Distance common(std::vector<Distance> parts);

/// The closed surface within 75 mm of the origin, by marching tetrahedra, its vertices moved onto the zero set.
Mesh mesh_of_solid(const Distance& solid, double cell_mm);

}  // namespace scanrig::campaign
