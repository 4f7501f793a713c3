#include "pipeline/texture/photo_looks.h"

namespace scanrig {

Eigen::Vector3f light_on(const PhotoView& view, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal) {
  const Transform& turntable_from_model = view.photo().turntable_from_model;
  return light.at(turntable_from_model.linear() * normal, turntable_from_model * point);
}

void look_from_all(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal, std::vector<PhotoLook>& looks) {
  looks.clear();
  for (std::size_t p = 0; p < views.size(); ++p) {
    const auto sight = views[p].look(point, normal);
    if (!sight) continue;
    looks.push_back({static_cast<std::uint16_t>(p), sight->pixel.cast<float>(), static_cast<float>(sight->weight),
                     light_on(views[p], light, point, normal)});
  }
}

}  // namespace scanrig
