#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/texture/photo_looks.h"
#include "pipeline/texture/point_colour.h"

namespace scanrig {

/// Colours of the texels of a few faces. Which photos show a face, where, and in which light, is looked up at its
/// corners, once, and is interpolated between them; faces larger than a few pixels of a photo are looked up texel by
/// texel. For one thread; its memory grows with the faces asked for. All arguments must outlive it.
class FaceColours {
 public:
  FaceColours(std::span<const PhotoView> views, const RigLight& light, const Mesh& mesh, const BlendOptions& options)
      : views_(views), light_(light), mesh_(mesh), options_(options) {}

  /// The paint at a place of a face. `weights`: barycentric, beyond the face continued in its plane; `inside`: the
  /// nearest within the face, whose light and weights hold.
  [[nodiscard]] PointColour at(std::uint32_t face, const Eigen::Vector3d& weights, const Eigen::Vector3d& inside);

 private:
  /// One photo at the corners of a face, column by column.
  struct Corners {
    std::uint16_t photo = 0;
    Eigen::Matrix<float, 2, 3> pixel = Eigen::Matrix<float, 2, 3>::Zero();
    Eigen::Vector3f weight = Eigen::Vector3f::Zero();  ///< 0: the photo does not show that corner
    Eigen::Matrix3f light = Eigen::Matrix3f::Ones();
  };
  struct Range {
    std::uint32_t begin = 0, end = 0;
    bool is_large = false;  ///< a face: too large to interpolate
  };
  /// What is known of the vertices or faces that were asked for.
  struct Known {
    std::vector<std::uint32_t> slot;  ///< of each vertex or face, from 1; 0: not asked for yet
    std::vector<Range> ranges;
  };

  Range looks_at_vertex(std::uint32_t vertex);
  Range photos_of_face(std::uint32_t face);
  /// One photo at the corners of a face; a corner that it does not show has no look. False if it cannot be
  /// interpolated.
  bool add_photo(const Mesh::Face& face, std::uint16_t photo, const std::array<const PhotoLook*, 3>& seen);
  [[nodiscard]] PointColour look(const Mesh::Face& face, const Eigen::Vector3d& weights,
                                 const Eigen::Vector3d& inside) const;

  std::span<const PhotoView> views_;
  const RigLight& light_;
  const Mesh& mesh_;
  const BlendOptions& options_;
  Known of_vertex_, of_face_;
  std::vector<PhotoLook> looks_;  ///< of vertices
  std::vector<Corners> photos_;   ///< of faces
  std::vector<PhotoLook> found_;
  std::vector<PaintSample> samples_;
};

}  // namespace scanrig
