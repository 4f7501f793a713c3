#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
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

/// Every photo of the lowest layer that shows `point` with unit `normal` (model frame, mm), in the order of `views`;
/// `looks` is overwritten.
void look_from_all(std::span<const PhotoView> views, const RigLight& light, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& normal, std::vector<PhotoLook>& looks);

/// Every photo that shows each vertex of a mesh.
class VertexLooks {
 public:
  VertexLooks(std::span<const PhotoView> views, const RigLight& light, const Mesh& mesh);

  /// In the order of the photos.
  [[nodiscard]] std::span<const PhotoLook> of(std::size_t vertex) const {
    const Block& block = blocks_[vertex / kBlock];
    const std::size_t i = vertex % kBlock;
    return {block.looks.data() + block.first[i], block.looks.data() + block.first[i + 1]};
  }

 private:
  static constexpr std::size_t kBlock = 1024;
  struct Block {
    std::vector<PhotoLook> looks;
    std::array<std::uint32_t, kBlock + 1> first{};
  };
  std::vector<Block> blocks_;
};

/// Calls `body(photo, seen)` for each photo that shows a corner of a face, in their order, until it returns false.
/// `seen`: its looks at the corners, null where it does not show one. `corners`: as of VertexLooks.
template <class Body>
void for_photos_of_face(std::array<std::span<const PhotoLook>, 3> corners, const Body& body) {
  constexpr std::uint16_t kNone = std::numeric_limits<std::uint16_t>::max();
  for (;;) {
    std::uint16_t photo = kNone;
    for (const auto& looks : corners) {
      if (!looks.empty()) photo = std::min(photo, looks.front().photo);
    }
    if (photo == kNone) return;
    std::array<const PhotoLook*, 3> seen{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (corners[k].empty() || corners[k].front().photo != photo) continue;
      seen[k] = &corners[k].front();
      corners[k] = corners[k].subspan(1);
    }
    if (!body(photo, seen)) return;
  }
}

/// Light of the rig on a point in one photo.
Eigen::Vector3f light_on(const PhotoView& view, const RigLight& light, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal);

}  // namespace scanrig
