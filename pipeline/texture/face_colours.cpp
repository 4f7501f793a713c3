#include "pipeline/texture/face_colours.h"

#include <algorithm>

namespace scanrig {
namespace {

/// Weights fade out over 12 px beside depth edges: between corners this far apart they are still nearly linear.
constexpr float kLargePx = 6.0F;

}  // namespace

const FaceColours::Range& FaceColours::looks_at_vertex(std::uint32_t vertex) {
  const auto [at, is_new] = of_vertex_.try_emplace(vertex);
  if (is_new) {
    look_from_all(views_, light_, mesh_.vertices[vertex].cast<double>(), mesh_.normals[vertex].cast<double>(), found_);
    at->second.begin = looks_.size();
    looks_.insert(looks_.end(), found_.begin(), found_.end());
    at->second.end = looks_.size();
  }
  return at->second;
}

bool FaceColours::add_photo(const Mesh::Face& face, std::uint16_t photo) {
  Corners corners{.photo = photo};
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t vertex = face[static_cast<std::size_t>(k)];
    const Range& range = looks_at_vertex(vertex);
    const auto begin = looks_.begin() + static_cast<std::ptrdiff_t>(range.begin);
    const auto end = looks_.begin() + static_cast<std::ptrdiff_t>(range.end);
    const auto seen = std::find_if(begin, end, [&](const PhotoLook& look) { return look.photo == photo; });
    if (seen != end) {
      corners.pixel.col(k) = seen->pixel;
      corners.weight[k] = seen->weight;
      corners.light.col(k) = seen->light;
      continue;
    }
    const PhotoView& view = views_[photo];
    const Eigen::Vector3d point = mesh_.vertices[vertex].cast<double>();
    const auto pixel = view.pixel_of(point);
    if (!pixel) return false;
    corners.pixel.col(k) = pixel->cast<float>();
    corners.light.col(k) = light_on(view, light_, point, mesh_.normals[vertex].cast<double>());
  }
  for (int k = 0; k < 3; ++k) {
    if ((corners.pixel.col(k) - corners.pixel.col((k + 1) % 3)).norm() > kLargePx) return false;
  }
  photos_.push_back(corners);
  return true;
}

const FaceColours::Range& FaceColours::photos_of_face(std::uint32_t face) {
  const auto [at, is_new] = of_face_.try_emplace(face);
  if (!is_new) return at->second;
  std::vector<std::uint16_t> photos;
  for (const std::uint32_t vertex : mesh_.faces[face]) {
    const Range range = looks_at_vertex(vertex);
    for (std::size_t i = range.begin; i < range.end; ++i) photos.push_back(looks_[i].photo);
  }
  std::ranges::sort(photos);
  photos.erase(std::ranges::unique(photos).begin(), photos.end());
  at->second.begin = photos_.size();
  at->second.is_large =
      !std::ranges::all_of(photos, [&](std::uint16_t photo) { return add_photo(mesh_.faces[face], photo); });
  at->second.end = photos_.size();
  return at->second;
}

PointColour FaceColours::look(const Mesh::Face& face, const Eigen::Vector3d& weights,
                              const Eigen::Vector3d& inside) const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t v = face[static_cast<std::size_t>(k)];
    point += weights[k] * mesh_.vertices[v].cast<double>();
    normal += inside[k] * mesh_.normals[v].cast<double>();
  }
  return blend_photos(views_, light_, point, normal.normalized(), options_);
}

PointColour FaceColours::at(std::uint32_t face, const Eigen::Vector3d& weights, const Eigen::Vector3d& inside) {
  const Range range = photos_of_face(face);
  if (range.is_large) return look(mesh_.faces[face], weights, inside);
  const Eigen::Vector3f place = weights.cast<float>(), within = inside.cast<float>();
  samples_.clear();
  for (std::size_t i = range.begin; i < range.end; ++i) {
    const Corners& corners = photos_[i];
    const float weight = corners.weight.dot(within);
    if (weight > 0.0F) {
      samples_.push_back(
          paint_in(views_[corners.photo], corners.pixel * place, weight, corners.light * within, options_));
    }
  }
  return majority(samples_, options_);
}

}  // namespace scanrig
