#pragma once

#include <memory>

#include "pipeline/mesh/mesh.h"
#include "pipeline/volume/distance_field.h"

namespace scanrig {

/// Moves every vertex of an extracted surface that range images support onto the measured zero set, smooths the rest
/// (by less than a voxel), and fills in normals, `views` and `sigma`. The topology is unchanged. Where faces cross
/// after that their vertices stay where they were, see untangle.h.
void finish_surface(std::unique_ptr<Field> field, const VolumeOptions& options, Mesh& mesh);

}  // namespace scanrig
