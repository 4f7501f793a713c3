#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/texture/photo_view.h"
#include "pipeline/texture/rig_light.h"

namespace scanrig {

/// One photo that shows a point.
struct PhotoLook {
  std::uint16_t photo = 0;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  ///< distortion included
  float weight = 0.0F;                              ///< as of Sight
  Eigen::Vector3f light = Eigen::Vector3f::Ones();  ///< of the rig on the point, BGR
};

/// Every photo that shows `point` with unit `normal` (model frame, mm), in the order of `views`; `looks` is
/// overwritten.
void look_from_all(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal, std::vector<PhotoLook>& looks);

/// Light of the rig on a point in one photo.
Eigen::Vector3f light_on(const PhotoView& view, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal);

}  // namespace scanrig
