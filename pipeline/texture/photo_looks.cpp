#include "pipeline/texture/photo_looks.h"

#include "core/parallel.h"

namespace scanrig {

Eigen::Vector3f light_on(const PhotoView& view, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal) {
  const Transform& turntable_from_model = view.photo().turntable_from_model;
  return light.at(turntable_from_model.linear() * normal, turntable_from_model * point);
}

void look_from_all(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal, std::vector<PhotoLook>& looks) {
  looks.clear();
  int layer = std::numeric_limits<int>::max();
  for (std::size_t p = 0; p < views.size(); ++p) {
    if (views[p].photo().layer > layer) continue;
    const auto sight = views[p].look(point, normal);
    if (!sight) continue;
    if (views[p].photo().layer < layer) looks.clear();
    layer = views[p].photo().layer;
    looks.push_back({static_cast<std::uint16_t>(p), sight->pixel.cast<float>(), static_cast<float>(sight->weight),
                     light_on(views[p], light, point, normal)});
  }
}

VertexLooks::VertexLooks(std::span<const PhotoView> views, const RigLight& light, const Mesh& mesh)
    : blocks_((mesh.vertices.size() + kBlock - 1) / kBlock) {
  parallel_for(blocks_.size(), [&](std::size_t b) {
    std::vector<PhotoLook> all, looks;
    Block& block = blocks_[b];
    for (std::size_t i = 0; i < kBlock; ++i) {
      if (const std::size_t v = b * kBlock + i; v < mesh.vertices.size()) {
        look_from_all(views, light, mesh.vertices[v].cast<double>(), mesh.normals[v].cast<double>(), looks);
        all.insert(all.end(), looks.begin(), looks.end());
      }
      block.first[i + 1] = static_cast<std::uint32_t>(all.size());
      looks.clear();
    }
    block.looks.assign(all.begin(), all.end());
  });
}

}  // namespace scanrig
