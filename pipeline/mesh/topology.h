#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// What holds a mesh together, counted over its faces. Vertices that no face uses count nowhere.
struct Topology {
  std::size_t components = 0;             ///< sets of faces joined through edges or vertices
  std::size_t boundary_edges = 0;         ///< edges of one face
  std::size_t non_manifold_edges = 0;     ///< edges of more than two faces, or of two that disagree about the outside
  std::size_t non_manifold_vertices = 0;  ///< vertices whose faces do not form one fan
  std::size_t degenerate_faces = 0;       ///< faces that name a vertex twice
  long euler = 0;                         ///< vertices - edges + faces

  /// Every edge has two faces that agree, every vertex one fan of faces.
  [[nodiscard]] bool watertight() const {
    return components > 0 && boundary_edges + non_manifold_edges + non_manifold_vertices + degenerate_faces == 0;
  }
  /// Handles over all components; meaningful only for a watertight mesh.
  [[nodiscard]] long genus() const { return static_cast<long>(components) - euler / 2; }
};

Topology topology(const Mesh& mesh);

/// For every face the number of its component; components are numbered by their first face.
struct Components {
  std::size_t count = 0;
  std::vector<std::uint32_t> of_face;
};
Components components(const Mesh& mesh);

/// The faces of `keep` (one flag a face) with the vertices they use, in their old order, attributes included.
Mesh kept_faces(const Mesh& mesh, const std::vector<bool>& keep);

/// The component that encloses the largest volume. Shells of cavities and loose bits go. An empty mesh stays empty.
Mesh largest_component(const Mesh& mesh);

}  // namespace scanrig
