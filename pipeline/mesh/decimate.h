#pragma once

#include <cstddef>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

struct DecimateOptions {
  double max_error_mm = 0.05;    ///< no vertex of the simplified mesh is farther from the surface (quadric estimate)
  std::size_t target_faces = 0;  ///< stop early at this many faces; 0: as few as the error allows
};

/// Fewer faces, same topology (meshoptimizer's edge collapse on a subset of the vertices; attributes are kept).
/// Normals are computed anew. Fails with `invalid_input` for an error that is not positive and with `not_closed`.
Result<Mesh> decimate(const Mesh& mesh, const DecimateOptions& options = {});

}  // namespace scanrig
