#pragma once

#include <functional>
#include <vector>

#include "pipeline/mesh/mesh.h"

/// Solids by signed distance and their meshes.
namespace scanrig::campaign {

/// Signed distance in mm, negative inside; nowhere more than the distance to the surface.
using Distance = std::function<double(const Eigen::Vector3d&)>;

Distance ball(const Eigen::Vector3d& centre, double radius);
Distance block(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
/// A cylinder from `a` to `b`.
Distance rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Balls of `radii` along the polyline `points`, and all between them.
Distance chain(std::vector<Eigen::Vector3d> points, std::vector<double> radii);
/// A ring about `axis`.
Distance ring(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double radius, double thickness);
/// What the closed polygon of (radius, height) sweeps about the y axis.
Distance lathe(std::vector<Eigen::Vector2d> profile);
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
