#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/mesh/mesh.h"
#include "pipeline/volume/block_grid.h"

namespace scanrig {

/// The triangles of one cell. Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1); bit c of a case is set where the corner
/// is inside. Edge 4 a + k runs along axis a; k holds the two other coordinates, the lower axis in its lower bit.
using CaseTriangles = std::vector<std::array<std::uint8_t, 3>>;

/// All 256 cases. On a face whose diagonals differ the two inside corners are joined, in both cells that share the
/// face: the surface closes. No triangle edge joins two edges of one cell face unless the surface cuts the face there:
/// the surface is manifold.
const std::array<CaseTriangles, 256>& marching_cubes_cases();

/// The surface where the grid's distance is zero, as one closed manifold mesh, triangles counter-clockwise seen from
/// outside. Vertices lie on grid edges; the order of vertices and faces depends on the grid alone.
Mesh extract_surface(const BlockGrid& grid);

}  // namespace scanrig
