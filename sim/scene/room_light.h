#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/transform.h"
#include "sim/scene/effects.h"
#include "sim/scene/object.h"
#include "sim/scene/ray_caster.h"

namespace scanrig::sim {

/// Openness of a surface to the room, and the light from around it.
struct Surroundings {
  Eigen::Vector3f ambient = Eigen::Vector3f::Zero();  ///< from sky, table and the object itself; a free, upward face: 1
  float openness = 1.0F;                              ///< share of the hemisphere that no part of the object covers

  Surroundings& operator+=(const Surroundings& other) {
    ambient += other.ambient;
    openness += other.openness;
    return *this;
  }
  Surroundings operator/(float n) const { return {ambient / n, openness / n}; }
};

/// The plain exposure's light: a sky that is the same all around, and three large soft boxes fixed in the room. The
/// sky's part turns with the object, so it is gathered once for each placement: by rays at the mesh's vertices and on a
/// grid over the table.
class RoomLight {
 public:
  RoomLight(const Object& object, const RayCaster& rays, const Transform& table_from_object,
            ScreenColour colour = ScreenColour::blue);

  [[nodiscard]] Surroundings at_vertex(int vertex) const { return vertices_[vertex]; }
  /// `x`, `z` in the table's own (turning) frame.
  [[nodiscard]] Surroundings on_table(double x, double z) const;

  /// One of the soft boxes: direction to its middle (turntable frame, unit) and its share of their light.
  struct SoftBox {
    Eigen::Vector3d towards;
    double share;
  };
  static const std::array<SoftBox, 3>& soft_boxes();

  /// Irradiance of a surface with unit normal `normal` (turntable frame, angle included).
  static Eigen::Vector3f irradiance(const Surroundings& surroundings, const Eigen::Vector3d& normal);

 private:
  std::vector<Surroundings> vertices_;
  cv::Mat table_;  // openness
};

}  // namespace scanrig::sim
