#include "pipeline/mesh/solid_properties.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace scanrig {
namespace {

constexpr double kMinFill = 1e-6;  ///< of the cube over the diagonal

struct Corners {
  Eigen::Vector3d a, b, c;
};

Corners corners(const Mesh& mesh, const Mesh::Face& face) {
  return {mesh.vertices[face[0]].cast<double>(), mesh.vertices[face[1]].cast<double>(),
          mesh.vertices[face[2]].cast<double>()};
}

std::uint64_t mix(std::uint64_t x) {  // SplitMix64
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

/// Each edge must be walked equally often both ways: sums of a hash of the edge, signed by the direction, cancel.
bool edges_cancel(const Mesh& mesh) {
  std::uint64_t sum = 0;
  for (const Mesh::Face& face : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = face[k];
      const std::uint64_t b = face[(k + 1) % 3];
      const std::uint64_t hash = mix((std::min(a, b) << 32) | std::max(a, b));
      sum += a < b ? hash : ~hash + 1;
    }
  }
  return sum == 0;
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
  if (!edges_cancel(mesh)) {
    return fail(ErrorCode::not_closed, "mesh: the surface bounds no solid: an edge has only one face");
  }
  if (mesh.faces.size() < 4) return fail(ErrorCode::degenerate, "mesh: {} faces bound no solid", mesh.faces.size());
  SolidProperties result;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v.cast<double>());
  result.size_mm = box.diagonal().norm();
  const Eigen::Vector3d apex = box.center();  // tetrahedra from here to each face: little cancellation
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const auto& face : mesh.faces) {
    const auto [p, q, r] = corners(mesh, face);
    const Eigen::Vector3d a = p - apex, b = q - apex, c = r - apex;
    const double volume = a.dot(b.cross(c)) / 6.0;
    result.volume_mm3 += volume;
    moment += volume * (a + b + c) / 4.0;
  }
  if (!(result.volume_mm3 > kMinFill * std::pow(result.size_mm, 3))) {
    return fail(ErrorCode::degenerate,
                "mesh: the enclosed volume is {:.3g} mm3; check that the surface is not inside out", result.volume_mm3);
  }
  result.centre_of_mass = apex + moment / result.volume_mm3;
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
