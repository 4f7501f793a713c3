#pragma once

#include <Eigen/Core>
#include <vector>

namespace scanrig::sim {

/// Triangles, corners counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
};

/// Every edge belongs to exactly two triangles that run through it in opposite directions.
bool is_closed(const TriangleMesh& mesh);

/// Centre of mass of the solid if the mesh is closed, else of its surface, of even density. Needs at least one triangle
/// with area.
Eigen::Vector3d centre_of_mass(const TriangleMesh& mesh);

/// Signed volume by the divergence theorem; meaningful for closed meshes only.
double volume(const TriangleMesh& mesh);

/// Area-weighted unit normals of the vertices.
std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh);

/// Vertices that are farthest in at least one of about 20,000 directions: enough for contact with a plane.
std::vector<Eigen::Vector3d> extreme_vertices(const std::vector<Eigen::Vector3d>& vertices);

/// Distance of the two points that are farthest apart.
double largest_extent(const std::vector<Eigen::Vector3d>& vertices);

/// Smallest circle around points in the plane.
struct Circle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double radius = 0.0;
};
Circle smallest_circle(const std::vector<Eigen::Vector2d>& points);

}  // namespace scanrig::sim
