#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The triangles of a mesh, ready for rays and for the nearest point. The only code of the pipeline that uses Embree
/// (3.13 or 4).
/// Threads: the const functions may be called from any number of threads. Same arguments, same result.
class SurfaceIndex {
 public:
  struct Hit {
    double distance = 0.0;  ///< in lengths of the direction
    std::uint32_t face = 0;
    Eigen::Vector3f weights;  ///< barycentric, of the face's three corners
  };
  struct Nearest {
    double distance = std::numeric_limits<double>::infinity();  ///< infinite: no surface within the limit
    std::uint32_t face = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
  };

  /// All faces, or those of `faces` (returned numbers are the mesh's). Fails with `degenerate` (no face), `internal`.
  static Result<SurfaceIndex> create(const Mesh& mesh);
  static Result<SurfaceIndex> create(const Mesh& mesh, const std::vector<std::uint32_t>& faces);
  ~SurfaceIndex();
  SurfaceIndex(SurfaceIndex&&) noexcept;
  SurfaceIndex& operator=(SurfaceIndex&&) noexcept;

  /// The nearest face, seen from either side, along origin + t * direction, t >= 0.
  [[nodiscard]] std::optional<Hit> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// Whether a face crosses the segment.
  [[nodiscard]] bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  [[nodiscard]] Nearest nearest(const Eigen::Vector3d& point,
                                double limit = std::numeric_limits<double>::infinity()) const;
  /// Calls `visit` with every face whose bounding box meets the ball, and perhaps others.
  void near(const Eigen::Vector3d& centre, double radius, const std::function<void(std::uint32_t)>& visit) const;

 private:
  struct Scene;
  explicit SurfaceIndex(std::unique_ptr<Scene> scene);
  std::unique_ptr<Scene> scene_;
};

/// The point of a triangle nearest to p [Ericson, Real-Time Collision Detection, 5.1.5].
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c);

}  // namespace scanrig
