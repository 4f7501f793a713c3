#pragma once

#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Takes corners of faces that cross another one back to `before`, where no two faces crossed; those around them, round
/// after round, until none crosses. Such vertices count as not measured: `views` 0, `sigma` NaN.
/// `before`: one position per vertex. Returns the number of vertices taken back. Fails as SurfaceIndex::create.
Result<std::size_t> untangle(const std::vector<Eigen::Vector3f>& before, Mesh& mesh);

}  // namespace scanrig
