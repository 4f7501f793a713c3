#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The mesh's vertices, doubled where faces that share one differ in its texture coordinate: for formats with one
/// coordinate per vertex.
struct CornerVertices {
  std::vector<std::uint32_t> vertex;  ///< of the mesh
  std::vector<Eigen::Vector2f> uv;    ///< zero without a texture
  std::vector<Mesh::Face> faces;      ///< into the two above

  explicit CornerVertices(const TexturedMesh& model) {
    constexpr auto none = std::numeric_limits<std::uint32_t>::max();
    const bool textured = model.corner_uv.size() == model.mesh.faces.size();
    std::vector<std::uint32_t> first(model.mesh.vertices.size(), none);
    std::vector<std::uint32_t> next;
    faces.reserve(model.mesh.faces.size());
    for (std::size_t f = 0; f < model.mesh.faces.size(); ++f) {
      Mesh::Face face;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = model.mesh.faces[f][k];
        const Eigen::Vector2f at = textured ? model.corner_uv[f][k] : Eigen::Vector2f::Zero();
        std::uint32_t i = first[v];
        while (i != none && uv[i] != at) i = next[i];
        if (i == none) {
          i = static_cast<std::uint32_t>(uv.size());
          vertex.push_back(v);
          uv.push_back(at);
          next.push_back(first[v]);
          first[v] = i;
        }
        face[k] = i;
      }
      faces.push_back(face);
    }
  }
};

}  // namespace scanrig
