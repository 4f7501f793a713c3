#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/mesh/surface_index.h"

namespace scanrig {

/// Numbers of the faces that cross another one, in order. Faces that share a corner do not count. `surface`: of `mesh`.
/// Threads: spread over the current arena, same result for any number.
std::vector<std::uint32_t> self_intersecting_faces(const Mesh& mesh, const SurfaceIndex& surface);

}  // namespace scanrig
