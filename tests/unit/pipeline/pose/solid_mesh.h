#pragma once

#include <array>
#include <map>

#include "pipeline/mesh/mesh.h"
#include "tests/unit/pipeline/registration/analytic_views.h"

namespace scanrig::testing {

/// Closed triangle mesh of `solid` inside [low, high] by marching tetrahedra.
inline Mesh mesh_of(const Solid& solid, const Eigen::Vector3d& low, const Eigen::Vector3d& high, double cell_mm) {
  const Eigen::Vector3i count = ((high - low) / cell_mm).array().ceil().cast<int>() + 1;
  const auto corner = [&](int id) {
    const int row = id / count.x(), layer = row / count.y();
    const Eigen::Vector3d at(id % count.x() + 0.013, row % count.y() + 0.017, layer + 0.011);
    return Eigen::Vector3d(low + cell_mm * at);  // off the round numbers where the solids have their faces
  };
  std::vector<double> value(static_cast<std::size_t>(count.prod()));
  for (int id = 0; id < count.prod(); ++id) value[id] = solid(corner(id));
  Mesh mesh;
  std::map<std::pair<int, int>, std::uint32_t> vertex_on;
  const auto vertex = [&](int in, int out) {
    const auto [it, fresh] = vertex_on.try_emplace({in, out}, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (fresh) {
      const double t = value[in] / (value[in] - value[out]);
      mesh.vertices.push_back((corner(in) + t * (corner(out) - corner(in))).cast<float>());
    }
    return it->second;
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, const Eigen::Vector3d& outside) {
    const Eigen::Vector3f n = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    const bool faces_out = n.dot(outside.cast<float>() - mesh.vertices[a]) > 0;
    mesh.faces.push_back(faces_out ? Mesh::Face{a, b, c} : Mesh::Face{a, c, b});
  };
  constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                     {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  for (int z = 0; z + 1 < count.z(); ++z) {
    for (int y = 0; y + 1 < count.y(); ++y) {
      for (int x = 0; x + 1 < count.x(); ++x) {
        for (const auto& tetrahedron : kTetrahedra) {
          std::vector<int> in;
          std::vector<int> out;
          for (const int c : tetrahedron) {
            const int id = ((z + (c >> 2)) * count.y() + y + ((c >> 1) & 1)) * count.x() + x + (c & 1);
            (value[id] < 0 ? in : out).push_back(id);
          }
          if (in.size() == 1) add(vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2]), corner(out[0]));
          if (in.size() == 3) add(vertex(in[0], out[0]), vertex(in[1], out[0]), vertex(in[2], out[0]), corner(out[0]));
          if (in.size() == 2) {
            const auto a = vertex(in[0], out[0]), b = vertex(in[0], out[1]);
            const auto c = vertex(in[1], out[1]), d = vertex(in[1], out[0]);
            add(a, b, c, corner(out[0]));
            add(a, c, d, corner(out[0]));
          }
        }
      }
    }
  }
  return mesh;
}

/// A closed box with its corners at `low` and `high`.
inline Mesh box_mesh(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  Mesh mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.emplace_back(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z());
  }
  constexpr std::uint32_t kQuads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : kQuads) {
    mesh.faces.push_back({q[0], q[1], q[2]});
    mesh.faces.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

}  // namespace scanrig::testing
