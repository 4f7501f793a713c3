#pragma once

#include <cstddef>

#include "pipeline/mesh/surface_index.h"

namespace scanrig {

/// Number of faces that cross another face with which they share no vertex. `surface`: index over all of the mesh.
std::size_t self_intersecting_faces(const Mesh& mesh, const SurfaceIndex& surface);

}  // namespace scanrig
