#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// A mesh that rays can be shot at; the only place that knows Embree (3.13 or 4).
/// Threads: first_hit may be called from any number of threads. Same ray, same hit.
class RayScene {
 public:
  struct Hit {
    float distance = 0.0F;  ///< in lengths of the direction
    std::uint32_t face = 0;
    Eigen::Vector3f weights;  ///< barycentric, of the face's three corners
  };

  /// Copies the mesh's geometry. Fails with `degenerate` (no face), `internal` (Embree refuses).
  static Result<RayScene> create(const Mesh& mesh);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// The nearest face, seen from either side, along origin + t * direction, t >= 0.
  [[nodiscard]] std::optional<Hit> first_hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;

 private:
  struct Scene;
  explicit RayScene(std::unique_ptr<Scene> scene);
  std::unique_ptr<Scene> scene_;
};

}  // namespace scanrig
