#pragma once

#include "pipeline/calibration/camera.h"
#include "pipeline/movement/compare_views.h"

namespace scanrig {

/// Limits for comparing two views whose reported table angles are `turned_deg` apart. Views are placed by the reported
/// angles, so the movement of the object by that angle is no slip. Whole turns do not count. `camera`: one of `rig`.
/// Objects are assumed to reach two thirds of the table's radius, seen at the distance of its axis.
CompareViewsOptions allowing_for(double turned_deg, const Camera& camera, const Calibration& rig);

}  // namespace scanrig
