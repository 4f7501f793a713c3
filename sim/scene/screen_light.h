#pragma once

#include <vector>

#include "sim/scene/effects.h"
#include "sim/scene/object.h"
#include "sim/scene/ray_caster.h"
#include "sim/scene/room_light.h"
#include "sim/scene/table_top.h"

namespace scanrig::sim {

/// What folds and the object do to the light of the screen behind the table, with the table at one angle.
/// Threads: const functions from any.
class ScreenLight {
 public:
  /// `turntable_from_object`: with the turn.
  ScreenLight(const Effects& effects, const Object& object, const RayCaster& rays, const RoomLight& light,
              const Transform& turntable_from_object);

  /// Of a free, flat screen's plain light at `point` of it (turntable frame): a factor, and light of the object's
  /// colour beside, as irradiance.
  struct Change {
    float factor = 1.0F;
    Eigen::Vector3f colour = Eigen::Vector3f::Zero();
  };
  [[nodiscard]] Change at(const Eigen::Vector3d& point) const;
  /// Brightness in the folds, 1: flat. Smooth over centimetres; the same for every rig.
  [[nodiscard]] double fold(const Eigen::Vector3d& point) const;

 private:
  [[nodiscard]] Eigen::Vector2d on_screen(const Eigen::Vector3d& point) const;

  Effects effects_;
  Backdrop screen_;
  Eigen::Vector3d along_, up_;
  std::vector<Change> nodes_;  // empty: the object changes nothing
};

}  // namespace scanrig::sim
