#pragma once

#include "pipeline/range/rectification.h"

namespace scanrig {

/// Sets the lowest and highest disparity that coarse matching searches: those of points of `volume` that both cameras
/// see. Projections and poses of `rectification` must be set. Returns false without such points.
[[nodiscard]] bool find_disparities(Rectification& rectification, const WorkingVolume& volume);

}  // namespace scanrig
