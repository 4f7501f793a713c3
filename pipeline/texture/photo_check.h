#pragma once

#include <span>
#include <vector>

#include "pipeline/texture/photo_view.h"
#include "pipeline/texture/rig_light.h"

namespace scanrig {

/// Compares every photo with the blend of all, spot by spot, and takes connected parts that differ out of `views`,
/// first those that differ all over. `normals`: unit, one per vertex. In the order of the photos; same bits for any
/// number of threads.
std::vector<ContradictedPhoto> leave_out_contradicted(std::span<PhotoView> views, const RigLight& light,
                                                      const Mesh& mesh, const std::vector<Eigen::Vector3f>& normals,
                                                      const BlendOptions& blending, const PhotoCheckOptions& options);

}  // namespace scanrig
