#include "pipeline/texture/face_colours.h"

#include <algorithm>
#include <limits>

namespace scanrig {
namespace {

/// Weights fade out over 12 px beside depth edges: between corners this far apart they are still nearly linear.
constexpr float kLargePx = 6.0F;

}  // namespace

void FaceColours::choose(std::uint32_t face) {
  face_ = mesh_.faces[face];
  is_large_ = false;
  photos_.clear();
  const auto& [a, b, c] = face_;
  int layer = std::numeric_limits<int>::max();
  for (const std::uint32_t corner : face_) {
    if (!looks_.of(corner).empty()) layer = std::min(layer, views_[looks_.of(corner).front().photo].photo().layer);
  }
  for_photos_of_face({looks_.of(a), looks_.of(b), looks_.of(c)}, [&](std::uint16_t photo, const auto& seen) {
    if (views_[photo].photo().layer > layer) return true;
    is_large_ = !add_photo(photo, seen);
    return !is_large_;
  });
}

bool FaceColours::add_photo(std::uint16_t photo, const std::array<const PhotoLook*, 3>& seen) {
  Corners corners{.photo = photo};
  for (int k = 0; k < 3; ++k) {
    const auto corner = static_cast<std::size_t>(k);
    if (seen[corner] != nullptr) {
      corners.pixel.col(k) = seen[corner]->pixel;
      corners.weight[k] = seen[corner]->weight;
      corners.light.col(k) = seen[corner]->light;
      continue;
    }
    const PhotoView& view = views_[photo];
    const Eigen::Vector3d point = mesh_.vertices[face_[corner]].cast<double>();
    const auto pixel = view.pixel_of(point);
    if (!pixel) return false;
    corners.pixel.col(k) = pixel->cast<float>();
    corners.light.col(k) = light_on(view, light_, point, mesh_.normals[face_[corner]].cast<double>());
  }
  for (int k = 0; k < 3; ++k) {
    if ((corners.pixel.col(k) - corners.pixel.col((k + 1) % 3)).squaredNorm() > kLargePx * kLargePx) return false;
  }
  photos_.push_back(corners);
  return true;
}

PointColour FaceColours::look(const Eigen::Vector3d& weights, const Eigen::Vector3d& inside) const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t v = face_[static_cast<std::size_t>(k)];
    point += weights[k] * mesh_.vertices[v].cast<double>();
    normal += inside[k] * mesh_.normals[v].cast<double>();
  }
  return blend_photos(views_, light_, point, normal.normalized(), options_);
}

PointColour FaceColours::at(const Eigen::Vector3d& weights, const Eigen::Vector3d& inside) {
  if (is_large_) return look(weights, inside);
  const Eigen::Vector3f place = weights.cast<float>(), within = inside.cast<float>();
  samples_.clear();
  for (const Corners& corners : photos_) {
    const float weight = corners.weight.dot(within);
    if (weight > 0.0F) {
      samples_.push_back(
          paint_in(views_[corners.photo], corners.pixel * place, weight, corners.light * within, options_));
    }
  }
  return majority(samples_, options_);
}

}  // namespace scanrig
