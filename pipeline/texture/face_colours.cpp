#include "pipeline/texture/face_colours.h"

#include <algorithm>
#include <limits>

namespace scanrig {
namespace {

/// Weights fade out over 12 px beside depth edges: between corners this far apart they are still nearly linear.
constexpr float kLargePx = 6.0F;

}  // namespace

FaceColours::Range FaceColours::looks_at_vertex(std::uint32_t vertex) {
  if (of_vertex_.slot.empty()) of_vertex_.slot.resize(mesh_.vertices.size());
  std::uint32_t& slot = of_vertex_.slot[vertex];
  if (slot == 0) {
    look_from_all(views_, light_, mesh_.vertices[vertex].cast<double>(), mesh_.normals[vertex].cast<double>(), found_);
    Range range{.begin = static_cast<std::uint32_t>(looks_.size())};
    looks_.insert(looks_.end(), found_.begin(), found_.end());
    range.end = static_cast<std::uint32_t>(looks_.size());
    of_vertex_.ranges.push_back(range);
    slot = static_cast<std::uint32_t>(of_vertex_.ranges.size());
  }
  return of_vertex_.ranges[slot - 1];
}

bool FaceColours::add_photo(const Mesh::Face& face, std::uint16_t photo, const std::array<const PhotoLook*, 3>& seen) {
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
    const Eigen::Vector3d point = mesh_.vertices[face[corner]].cast<double>();
    const auto pixel = view.pixel_of(point);
    if (!pixel) return false;
    corners.pixel.col(k) = pixel->cast<float>();
    corners.light.col(k) = light_on(view, light_, point, mesh_.normals[face[corner]].cast<double>());
  }
  for (int k = 0; k < 3; ++k) {
    if ((corners.pixel.col(k) - corners.pixel.col((k + 1) % 3)).squaredNorm() > kLargePx * kLargePx) return false;
  }
  photos_.push_back(corners);
  return true;
}

FaceColours::Range FaceColours::photos_of_face(std::uint32_t face) {
  if (of_face_.slot.empty()) of_face_.slot.resize(mesh_.faces.size());
  if (const std::uint32_t slot = of_face_.slot[face]; slot != 0) return of_face_.ranges[slot - 1];
  std::array<Range, 3> left;  // of the corners' looks, each in the order of photos
  for (std::size_t k = 0; k < 3; ++k) left[k] = looks_at_vertex(mesh_.faces[face][k]);
  Range range{.begin = static_cast<std::uint32_t>(photos_.size())};
  while (!range.is_large) {
    constexpr std::uint16_t kNone = std::numeric_limits<std::uint16_t>::max();
    std::uint16_t photo = kNone;
    for (const Range& looks : left) {
      if (looks.begin < looks.end) photo = std::min(photo, looks_[looks.begin].photo);
    }
    if (photo == kNone) break;
    std::array<const PhotoLook*, 3> seen{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (left[k].begin < left[k].end && looks_[left[k].begin].photo == photo) seen[k] = &looks_[left[k].begin++];
    }
    range.is_large = !add_photo(mesh_.faces[face], photo, seen);
  }
  range.end = static_cast<std::uint32_t>(photos_.size());
  of_face_.ranges.push_back(range);
  of_face_.slot[face] = static_cast<std::uint32_t>(of_face_.ranges.size());
  return range;
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
  for (std::uint32_t i = range.begin; i < range.end; ++i) {
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
