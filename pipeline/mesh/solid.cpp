#include "pipeline/mesh/solid.h"

#include <Eigen/Geometry>
#include <cmath>

#include "pipeline/mesh/topology.h"

namespace scanrig {
namespace {

struct Corners {
  Eigen::Vector3d a, b, c;
};

Corners corners(const Mesh& mesh, const Mesh::Face& face) {
  return {mesh.vertices[face[0]].cast<double>(), mesh.vertices[face[1]].cast<double>(),
          mesh.vertices[face[2]].cast<double>()};
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

double surface_area(const Mesh& mesh) {
  double area = 0.0;
  for (const auto& face : mesh.faces) {
    const auto [a, b, c] = corners(mesh, face);
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

Result<SolidProperties> solid_properties(const Mesh& mesh) {
  const Topology shape = topology(mesh);
  if (!shape.watertight()) {
    return fail(ErrorCode::not_closed,
                "mesh: the surface bounds no solid ({} open edges, {} non-manifold edges, {} non-manifold vertices)",
                shape.boundary_edges, shape.non_manifold_edges, shape.non_manifold_vertices);
  }
  const Eigen::Vector3d origin = mesh.vertices[mesh.faces[0][0]].cast<double>();  // near the solid: less cancellation
  SolidProperties result;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const auto& face : mesh.faces) {
    const auto [p, q, r] = corners(mesh, face);
    const Eigen::Vector3d a = p - origin, b = q - origin, c = r - origin;
    const double volume = a.dot(b.cross(c)) / 6.0;
    result.volume_mm3 += volume;
    moment += volume / 4.0 * (a + b + c);
  }
  if (!(result.volume_mm3 > 0.0)) {
    return fail(ErrorCode::degenerate, "mesh: the enclosed volume is {:.3g} mm3; is the surface inside out?",
                result.volume_mm3);
  }
  result.centre_of_mass = origin + moment / result.volume_mm3;
  result.area_mm2 = surface_area(mesh);
  return result;
}

std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& face : mesh.faces) {
    const auto [a, b, c] = corners(mesh, face);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > 0.0)) continue;
    const Eigen::Vector3d unit = normal.normalized();
    sums[face[0]] += angle_between(b - a, c - a) * unit;
    sums[face[1]] += angle_between(c - b, a - b) * unit;
    sums[face[2]] += angle_between(a - c, b - c) * unit;
  }
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(sums.size());
  for (const auto& sum : sums) normals.push_back(sum.normalized().cast<float>());
  return normals;
}

}  // namespace scanrig
