#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Numbers of the faces that cross another one, in order. Faces that share a corner do not count. `is_moved`, one entry
/// per vertex or none: pairs of faces without such a corner are left out.
/// Threads: spread over the current arena, same result for any number.
std::vector<std::uint32_t> self_intersecting_faces(const Mesh& mesh, const std::vector<bool>& is_moved = {});

}  // namespace scanrig
