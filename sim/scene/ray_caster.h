#pragma once

#include <memory>

#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// First hits on one mesh, by Embree: the only file that depends on its version.
/// Threads: const functions from any.
class RayCaster {
 public:
  struct Hit {
    int triangle = -1;  ///< -1: nothing was hit
    double u = 0.0;     ///< weights of the triangle's second and third corner
    double v = 0.0;
  };

  explicit RayCaster(const TriangleMesh& mesh);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// Both sides of a triangle count. `direction` need not be a unit vector.
  [[nodiscard]] Hit first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// Whether any triangle lies between `from` and `from + way`.
  [[nodiscard]] bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& way) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace scanrig::sim
