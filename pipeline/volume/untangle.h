#pragma once

#include <cstddef>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Moves the corners of faces that cross another face back to their positions in `before`, where no faces crossed, and
/// repeats until none cross. Vertices moved back count as not measured: `views` 0, `sigma` NaN.
/// `before`: one position per vertex. Returns the number of vertices taken back.
std::size_t untangle(const std::vector<Eigen::Vector3f>& before, Mesh& mesh);

}  // namespace scanrig
