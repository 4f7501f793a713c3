#pragma once

#include <memory>

#include "sim/scene/object.h"

namespace scanrig::sim {

/// A box with its corners at +-half.
inline TriangleMesh box(const Eigen::Vector3d& half) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign((i & 1) * 2 - 1, (i >> 1 & 1) * 2 - 1, (i >> 2 & 1) * 2 - 1);
    mesh.vertices.push_back(half.cwiseProduct(sign));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// An object of one even grey.
inline Object grey(TriangleMesh mesh, float albedo) {
  Object object;
  object.name = "test";
  object.normals = vertex_normals(mesh);
  object.colour = vertex_colour(std::vector<Eigen::Vector3f>(mesh.vertices.size(), Eigen::Vector3f::Constant(albedo)),
                                mesh.triangles);
  object.mesh = std::move(mesh);
  return object;
}

}  // namespace scanrig::sim
