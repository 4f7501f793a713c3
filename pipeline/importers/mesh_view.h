#pragma once

#include <filesystem>

#include "core/result.h"
#include "pipeline/importers/grid_resampling.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The view that an open mesh shows of an object, mm: its depth, seen against the mean of its normals, on a grid of its
/// vertices' spacing (but 200 to 1000 pixels along the mesh). Vertex normals say which side is outside; without them
/// faces are counter-clockwise seen from there. Faces seen at more than 75 degrees of incidence bridge depth steps and
/// are left out. Fails with `invalid_input` (no face has an area; the mesh looks to all sides, so it is no single
/// view).
Result<ResampledGrid> view_of_mesh(const Mesh& mesh);

/// The view in a file: a PLY range grid, or a mesh (PLY, OBJ, STL, GLB). `unit_mm`: length of the file's unit; 0:
/// metres for range grids and millimetres for meshes (GLB says it itself). Fails with `not_found`, `io`,
/// `invalid_input`, `unsupported` and `degenerate`, naming the file.
Result<ResampledGrid> read_view(const std::filesystem::path& file, double unit_mm);

}  // namespace scanrig
