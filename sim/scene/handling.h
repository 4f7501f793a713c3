#pragma once

#include <Eigen/Core>

#include "core/transform.h"
#include "sim/scene/effects.h"

namespace scanrig::sim {

/// What hands do to one view of a scan: its sizes are those of Effects, 0 in every other view.
struct Handling {
  double creep_mm = 0.0, rock_deg = 0.0, finger = 0.0, overexposed = 0.0, sticker = 0.0, shadow = 0.0;

  /// all(): of any view. of_view(): of the view at `angle_deg` of `pose`: one view in `views` a turn, drawn by the
  /// seed, of the first pose. The first view of a pose is spared, as it is taken twice.
  static Handling all(const Effects& effects);
  static Handling of_view(const Effects& effects, std::uint64_t seed, int views, int pose, double angle_deg);

  /// table_from_object with the object moved: crept along +X, rocked about +X.
  [[nodiscard]] Transform moved(const Transform& table_from_object) const;
  /// Share of a patch of `reach` mm around a spot of the object, soft at its edge.
  [[nodiscard]] static float patch(const Eigen::Vector3d& in_object, const Eigen::Vector3d& spot, double reach);
};

}  // namespace scanrig::sim
