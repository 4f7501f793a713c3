#include "pipeline/movement/turned_table.h"

#include <cmath>

#include "core/units.h"

namespace scanrig {

CompareViewsOptions allowing_for(double turned_deg, const Camera& camera, const Calibration& rig) {
  CompareViewsOptions options;
  const double reach_mm = options.object_reach * rig.table_radius_mm;
  const double mm_per_px = camera.projection.mm_per_pixel(camera.camera_from_turntable.translation().norm());
  options.max_shift_px += to_radians(std::abs(std::remainder(turned_deg, 360.0))) * reach_mm / mm_per_px;
  return options;
}

}  // namespace scanrig
