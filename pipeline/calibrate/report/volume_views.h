#pragma once

#include <Eigen/Core>

#include "pipeline/calibrate/report/drawing.h"

namespace scanrig::report {

/// Two views of the turntable frame: from above with the cameras below, from the side with the cameras to the right.
struct VolumeViews {
  double reach_mm = 100.0;  ///< to each side of the axis
  double low_mm = -8.0;
  double top_mm = 120.0;
  double width_px = 500.0;

  /// With the table (radius 0: none) and the volume that is graded.
  [[nodiscard]] Drawing above(double table_radius_mm) const;
  [[nodiscard]] Drawing side(double table_radius_mm) const;
  [[nodiscard]] Window window_above() const;
  [[nodiscard]] Window window_side() const;

  static Eigen::Vector2d in_above(const Eigen::Vector3d& p) { return {p.x(), p.z()}; }
  static Eigen::Vector2d in_side(const Eigen::Vector3d& p) { return {p.z(), p.y()}; }
};

}  // namespace scanrig::report
