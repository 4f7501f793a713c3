#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "pipeline/evaluate/true_view.h"

namespace scanrig {

/// The smallest solid that perfect silhouettes, the table and perfect free space leave of the object: the best possible
/// closing of the unseen surface. Free space is the space between the left camera and an observable point.
class IdealCarve {
 public:
  IdealCarve(const Mesh& truth, double voxel_mm);

  /// Cuts away what the view shows to be free.
  void cut(const TrueView& view);

  /// After the last cut: distance of each point to the solid's surface, mm, accurate to a fraction of a voxel near it.
  [[nodiscard]] std::vector<double> distances(const std::vector<SurfaceSample>& samples) const;

 private:
  [[nodiscard]] Eigen::Vector3d centre(int x, int y, int z) const {
    return origin_ + voxel_ * Eigen::Vector3d(x, y, z);
  }
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * size_.y() + y) * size_.x() + x;
  }
  /// A point of the surface and its outward normal.
  struct Crossing {
    Eigen::Vector3d point;
    Eigen::Vector3d normal;
  };
  [[nodiscard]] std::vector<Crossing> crossings() const;

  double voxel_;
  Eigen::Vector3d origin_;
  Eigen::Vector3i size_;
  std::vector<float> outside_;  ///< mm outside the remaining solid, near its surface; clamped
};

}  // namespace scanrig
