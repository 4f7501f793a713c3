#include "pipeline/mesh/self_intersection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <vector>

#include "core/parallel.h"

namespace scanrig {
namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Six times the signed volume of a tetrahedron.
double volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t) {
  if (volume(t[0], t[1], t[2], p) * volume(t[0], t[1], t[2], q) >= 0.0) return false;
  const double u = volume(p, q, t[0], t[1]), v = volume(p, q, t[1], t[2]), w = volume(p, q, t[2], t[0]);
  return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

/// Whether `b` lies on one side of the plane of `a`.
bool is_beside(const Triangle& a, const Triangle& b) {
  const double first = volume(a[0], a[1], a[2], b[0]);
  return first * volume(a[0], a[1], a[2], b[1]) > 0.0 && first * volume(a[0], a[1], a[2], b[2]) > 0.0;
}

/// Two triangles cross if an edge of one crosses the other.
bool cross(const Triangle& a, const Triangle& b) {
  if (is_beside(a, b) || is_beside(b, a)) return false;
  for (int k = 0; k < 3; ++k) {
    if (crosses(a[k], a[(k + 1) % 3], b) || crosses(b[k], b[(k + 1) % 3], a)) return true;
  }
  return false;
}

Triangle triangle_of(const Mesh& mesh, const Mesh::Face& face) {
  return {mesh.vertices[face[0]].cast<double>(), mesh.vertices[face[1]].cast<double>(),
          mesh.vertices[face[2]].cast<double>()};
}

bool share_vertex(const Mesh::Face& a, const Mesh::Face& b) {
  return std::any_of(a.begin(), a.end(), [&b](std::uint32_t v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

}  // namespace

std::vector<std::uint32_t> self_intersecting_faces(const Mesh& mesh, const SurfaceIndex& surface) {
  constexpr std::size_t kBlock = 1024;
  std::vector<std::vector<std::uint32_t>> found((mesh.faces.size() + kBlock - 1) / kBlock);
  parallel_for(found.size(), [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(mesh.faces.size(), (block + 1) * kBlock); ++i) {
      const Triangle mine = triangle_of(mesh, mesh.faces[i]);
      const Eigen::Vector3d centre = (mine[0] + mine[1] + mine[2]) / 3.0;
      double radius = 0.0;
      for (const auto& corner : mine) radius = std::max(radius, (corner - centre).norm());
      bool crossing = false;
      surface.near(centre, radius, [&](std::uint32_t j) {
        if (crossing || share_vertex(mesh.faces[i], mesh.faces[j])) return;
        crossing = cross(mine, triangle_of(mesh, mesh.faces[j]));
      });
      if (crossing) found[block].push_back(static_cast<std::uint32_t>(i));
    }
  });
  std::vector<std::uint32_t> faces;
  for (const auto& some : found) faces.insert(faces.end(), some.begin(), some.end());
  return faces;
}

}  // namespace scanrig
