#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/transform.h"
#include "pipeline/silhouette/silhouette.h"

namespace scanrig {

/// Outer bounds of the object: silhouettes (the visual hull), the planes of the table, a box. Distances are mm,
/// positive outside; the silhouettes' images are referred to, not copied.
class Hull {
 public:
  explicit Hull(const Eigen::AlignedBox3f& box) : box_(box) {}
  void add_silhouette(const Silhouette& silhouette, const Transform& model_from_pose);
  void add_table(const Transform& model_from_pose);  ///< the pose's plane y = 0; nothing is below it

  /// The largest of the distances to all bounds.
  [[nodiscard]] float distance(const Eigen::Vector3f& point_in_model) const;

  /// Whether distance() is more than `limit`; faster.
  [[nodiscard]] bool is_beyond(const Eigen::Vector3f& point_in_model, float limit) const;

  /// The same hull without the silhouettes that cannot matter within `radius` of `centre` while values below `-band`
  /// are equivalent.
  [[nodiscard]] Hull near(const Eigen::Vector3f& centre, float radius, float band) const;

 private:
  struct Outline {
    const Silhouette* silhouette;
    Eigen::Matrix3f rotation;  ///< camera from model
    Eigen::Vector3f translation;
    [[nodiscard]] float distance(const Eigen::Vector3f& point) const;
  };
  Eigen::AlignedBox3f box_;
  std::vector<Outline> outlines_;
  std::vector<Eigen::Hyperplane<float, 3>> tables_;  ///< normals point down, away from the object
};

}  // namespace scanrig
