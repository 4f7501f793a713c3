#pragma once

#include <cstddef>

#include "pipeline/mesh/surface_index.h"

namespace scanrig {

/// How many faces cross another face with which they share no vertex. `surface`: of all of the mesh.
std::size_t self_intersecting_faces(const Mesh& mesh, const SurfaceIndex& surface);

}  // namespace scanrig
