#pragma once

#include "pipeline/calibration/camera.h"
#include "pipeline/movement/compare_views.h"

namespace scanrig {

/// Limits for comparing two views of which the table itself says that they were taken `turned_deg` apart: views are
/// placed by what it says, so what an object moves by that is no slip. Whole turns count for nothing. `camera`: one of
/// `rig`; objects are taken to reach two thirds of the table's radius, seen at the distance of its axis.
CompareViewsOptions allowing_for(double turned_deg, const Camera& camera, const Calibration& rig);

}  // namespace scanrig
