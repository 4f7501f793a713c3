#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pipeline/texture/photo_looks.h"
#include "pipeline/texture/point_colour.h"

namespace scanrig {

/// Colours of the texels of one face after another. Which photos show a face, where, and in which light, is
/// interpolated between the looks at its corners; faces larger than a few pixels of a photo are looked up texel by
/// texel. For one thread. All arguments must outlive it.
class FaceColours {
 public:
  FaceColours(std::span<const PhotoView> views, const RigLight& light, const Mesh& mesh, const VertexLooks& looks,
              const BlendOptions& options)
      : views_(views), light_(light), mesh_(mesh), looks_(looks), options_(options) {}

  /// The face of the next texels.
  void choose(std::uint32_t face);
  /// The paint at a place of the chosen face. `weights`: barycentric, beyond the face continued in its plane; `inside`:
  /// the nearest within the face, whose light and weights hold.
  [[nodiscard]] PointColour at(const Eigen::Vector3d& weights, const Eigen::Vector3d& inside);

 private:
  /// One photo at the corners of a face, column by column.
  struct Corners {
    std::uint16_t photo = 0;
    Eigen::Matrix<float, 2, 3> pixel = Eigen::Matrix<float, 2, 3>::Zero();
    Eigen::Vector3f weight = Eigen::Vector3f::Zero();  ///< 0: the photo does not show that corner
    Eigen::Matrix3f light = Eigen::Matrix3f::Ones();
  };

  /// One photo at the corners of the chosen face; a corner that it does not show has no look. False if it cannot be
  /// interpolated.
  bool add_photo(std::uint16_t photo, const std::array<const PhotoLook*, 3>& seen);
  [[nodiscard]] PointColour look(const Eigen::Vector3d& weights, const Eigen::Vector3d& inside) const;

  std::span<const PhotoView> views_;
  const RigLight& light_;
  const Mesh& mesh_;
  const VertexLooks& looks_;
  const BlendOptions& options_;
  Mesh::Face face_{};
  bool is_large_ = false;  ///< the chosen face: too large to interpolate
  std::vector<Corners> photos_;
  std::vector<PaintSample> samples_;
};

}  // namespace scanrig
