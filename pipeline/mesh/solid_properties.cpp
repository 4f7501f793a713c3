#include "pipeline/mesh/solid_properties.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/parallel_blocks.h"

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
  struct FaceShare {
    Eigen::Vector3d unit;
    std::array<double, 3> angles;  ///< at the corners; none of a face without area
  };
  constexpr std::size_t kBatch = 65536;  // faces, computed side by side and added in their order
  std::vector<FaceShare> shares(std::min(kBatch, mesh.faces.size()));
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (std::size_t first = 0; first < mesh.faces.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, mesh.faces.size() - first);
    for_each_in_blocks(count, [&](std::size_t i) {
      const auto [a, b, c] = corners(mesh, mesh.faces[first + i]);
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      shares[i] = {Eigen::Vector3d::Zero(), {}};
      if (!(normal.norm() > 0.0)) return;
      shares[i] = {normal.normalized(),
                   {angle_between(b - a, c - a), angle_between(c - b, a - b), angle_between(a - c, b - c)}};
    });
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) sums[mesh.faces[first + i][k]] += shares[i].angles[k] * shares[i].unit;
    }
  }
  std::vector<Eigen::Vector3f> normals(sums.size());
  for_each_in_blocks(sums.size(), [&](std::size_t v) { normals[v] = sums[v].normalized().cast<float>(); });
  return normals;
}

}  // namespace scanrig
