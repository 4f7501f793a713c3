#pragma once

#include <vector>

#include "sim/scene/effects.h"
#include "sim/scene/gathering.h"
#include "sim/scene/lamp.h"
#include "sim/scene/object.h"
#include "sim/scene/ray_caster.h"

namespace scanrig::sim {

/// What the object's vertices and the table's nodes see of each other: made once for each pose, as it turns with the
/// object.
class BouncePaths {
 public:
  BouncePaths(const Object& object, const RayCaster& rays, const Transform& table_from_object,
              ScreenColour colour = ScreenColour::blue);

 private:
  friend class BounceLight;
  static constexpr int kVertexRays = 24;  // smoothed over the neighbours afterwards
  static constexpr int kTableRays = 96;
  static constexpr int kNothing = -1;

  /// What the ray meets: a vertex of the object, or beyond those a node of the table.
  [[nodiscard]] int met_by(const RayCaster& rays, const Object& object, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& way) const;

  const Transform table_from_object_;
  int vertex_count_;
  std::vector<int> met_;                 // per vertex, then per node
  std::vector<Eigen::Vector3f> albedo_;  // per vertex, then once for the table
};

/// One diffuse bounce of the projector's light between parts of the object and the table, with the table at one angle.
/// Dots are averaged: their light is spread over millimetres.
class BounceLight {
 public:
  /// `turntable_from_table`: the turn.
  BounceLight(const BouncePaths& paths, const Object& object, const RayCaster& rays, const Lamp& lamp,
              const Transform& turntable_from_table);

  /// Irradiance by the bounce, full scale of the sensor on white.
  [[nodiscard]] const Eigen::Vector3f& at_vertex(int vertex) const { return vertices_[vertex]; }
  [[nodiscard]] Eigen::Vector3f on_table(double x, double z) const;

 private:
  std::vector<Eigen::Vector3f> vertices_;
  std::vector<Eigen::Vector3f> nodes_;
};

}  // namespace scanrig::sim
