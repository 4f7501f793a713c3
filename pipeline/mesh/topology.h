#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Connectivity of a mesh, counted over its faces. Vertices without faces are not counted.
struct Topology {
  std::size_t components = 0;             ///< sets of faces joined through edges or vertices
  std::size_t boundary_edges = 0;         ///< edges of one face
  std::size_t non_manifold_edges = 0;     ///< edges of more than two faces, or of two with opposite orientations
  std::size_t non_manifold_vertices = 0;  ///< vertices whose faces do not form one fan
  std::size_t degenerate_faces = 0;       ///< faces with the same vertex twice
  long euler = 0;                         ///< vertices - edges + faces

  /// Every edge has two consistently oriented faces, every vertex one fan of faces.
  [[nodiscard]] bool watertight() const {
    return components > 0 && boundary_edges + non_manifold_edges + non_manifold_vertices + degenerate_faces == 0;
  }
  /// Handles over all components; meaningful only for a watertight mesh.
  [[nodiscard]] long genus() const { return static_cast<long>(components) - euler / 2; }
};

Topology topology(const Mesh& mesh);

/// Handles of the largest_component() of a mesh that is known to be watertight, as every extracted surface is; 0 of an
/// empty one.
long genus_of_largest(const Mesh& mesh);

/// Component number of every face; components are numbered by their first face.
struct Components {
  std::size_t count = 0;
  std::vector<std::uint32_t> of_face;
};
Components components(const Mesh& mesh);

/// The faces of `keep` (one flag per face) with the vertices they use, in their old order, attributes included.
Mesh kept_faces(const Mesh& mesh, const std::vector<bool>& keep);

/// The surface with one vertex where several lie on the same place, as in files that repeat them for each triangle;
/// faces that become lines are gone, and so are attributes.
Mesh joined_vertices(const Mesh& mesh);

/// The component that encloses the largest volume, without shells of cavities and loose pieces. An empty mesh stays
/// empty.
Mesh largest_component(const Mesh& mesh);

}  // namespace scanrig
