#pragma once

#include <optional>

#include "sim/scene/effects.h"
#include "sim/scene/rig_variation.h"

namespace scanrig::sim {

/// The rig of a simulation: the default one, or a drawn one, with the errors of its lenses and its turntable. Boards
/// and objects see the same rig. Same arguments, same bits.
DrawnRig make_rig(const std::optional<RigVariation>& variation, const Effects& effects, double image_scale);

/// Minutes since the cameras were switched on.
struct WarmUp {
  double minutes = 1e9;  ///< as declared: warm
};

/// The cameras of `rig`, which are those of a warm rig, at that time: turned against each other, their baseline
/// shorter, less and less so with a time constant of ten minutes.
RigGeometry at_time(const RigGeometry& rig, const Effects& effects, const WarmUp& time);

}  // namespace scanrig::sim
