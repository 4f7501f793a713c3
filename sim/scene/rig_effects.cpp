#include "sim/scene/rig_effects.h"

#include <cmath>

#include "core/units.h"
#include "sim/scene/lens_residual.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

constexpr std::uint64_t kThisRig = 0x776f726b;  // every simulation of profile 2 has the same rig
constexpr double kTimeConstantMin = 10.0;       // assumed: warm after half an hour

}  // namespace

DrawnRig make_rig(const std::optional<RigVariation>& variation, const Effects& effects, double image_scale) {
  DrawnRig rig = variation ? draw_rig(*variation, image_scale) : DrawnRig{.geometry = default_rig(image_scale)};
  rig.table.is_drawn = variation.has_value();
  for (Eye* eye : {&rig.geometry.left, &rig.geometry.right}) {
    const bool is_left = eye == &rig.geometry.left;
    eye->focus_off_mm = (is_left ? -0.5 : 0.5) * effects.focus_difference_mm;
    if (effects.lens_residual_px > 0.0 && !eye->residual)
      eye->residual = draw_lens_residual(*eye, effects.lens_residual_px * image_scale, mix(kThisRig, is_left));
  }
  AxisErrors& axis = rig.table.axis;
  axis.runout_mm = effects.runout_mm;
  axis.wobble_rad = to_radians(effects.wobble_deg);
  axis.worm_deg = effects.worm_deg;
  if (effects.top_tilt_deg > 0.0) {
    const double tilt = to_radians(effects.top_tilt_deg) * std::sqrt(0.5);  // about each axis
    rig.table.axis_from_top = rig.table.axis_from_top * small_motion({tilt, 0.0, tilt}, Vector3d::Zero());
  }
  rig.table.axis_from_top.translation().y() += effects.top_height_mm;
  return rig;
}

RigGeometry at_time(const RigGeometry& rig, const Effects& effects, const WarmUp& time) {
  if (effects.drift_px == 0.0 && effects.drift_baseline_mm == 0.0) return rig;
  const double left_over = std::exp(-time.minutes / kTimeConstantMin);
  if (left_over < 1e-9) return rig;
  RigGeometry then = rig;
  const Vector3d along = (rig.right.centre() - rig.left.centre()).normalized();
  for (Eye* eye : {&then.left, &then.right}) {
    const double side = eye == &then.left ? -0.5 : 0.5;
    // Half of the turn along the rows, half across them.
    const double turn = side * left_over * effects.drift_px * eye->width / profile().width / eye->fx * std::sqrt(0.5);
    const Vector3d inwards = -side * left_over * effects.drift_baseline_mm * along;
    const Transform moved_back(Eigen::Translation3d(-inwards));
    eye->eye_from_turntable = small_motion({turn, turn, 0.0}, Vector3d::Zero()) * eye->eye_from_turntable * moved_back;
  }
  return then;
}

}  // namespace scanrig::sim
