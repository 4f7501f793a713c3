#pragma once

#include <Eigen/Core>
#include <array>

#include "sim/scene/effects.h"

namespace scanrig::sim {

inline constexpr int kRimDots = 40;

/// Displacements of the printed rim dots from where they are designed: x and z in the table's frame, mm. Dot i is the
/// one near azimuth i * 9 degrees, counter-clockwise seen from above, from +z.
using RimDotErrors = std::array<Eigen::Vector2d, kRimDots>;

inline const RimDotErrors kRimDotsAsDesigned = [] {
  RimDotErrors none;
  none.fill(Eigen::Vector2d::Zero());
  return none;
}();

/// Centre of a rim dot as designed: x and z in the table's frame, mm. Each is a little off its even place so that every
/// angle looks different.
Eigen::Vector2d rim_dot_centre(int dot);

/// Share of a rim dot under a sample `size` mm wide. `in_table`: point of the table top, in the table's frame.
double rim_dot_share(const Eigen::Vector3d& in_table, double size, const RimDotErrors& errors);

/// The cloth behind the table: a plane in the turntable frame that faces the default rig's cameras.
struct Backdrop {
  explicit Backdrop(ScreenColour colour = ScreenColour::blue);

  Eigen::Vector3d normal, point;
  Eigen::Vector3f albedo;

  /// From `eye` along `way`, in lengths of it.
  [[nodiscard]] double distance(const Eigen::Vector3d& eye, const Eigen::Vector3d& way) const {
    return (point - eye).dot(normal) / way.dot(normal);
  }
  /// Light from `on_cloth` in the plain exposure, linear RGB.
  [[nodiscard]] Eigen::Vector3f plain_light(const Eigen::Vector3d& on_cloth) const;
};

}  // namespace scanrig::sim
