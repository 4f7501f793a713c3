#include "pipeline/calibrate/report/volume_views.h"

#include "pipeline/calibration/solve/calibration_input.h"

namespace scanrig::report {

Window VolumeViews::window_above() const {
  return {.left = -reach_mm, .right = reach_mm, .top = -reach_mm, .bottom = reach_mm, .width_px = width_px};
}

Window VolumeViews::window_side() const {
  return {.left = -reach_mm, .right = reach_mm, .top = top_mm, .bottom = low_mm, .width_px = width_px};
}

Drawing VolumeViews::above(double table_radius_mm) const {
  Drawing drawing(window_above());
  if (table_radius_mm > 0.0) drawing.circle({0.0, 0.0}, table_radius_mm, "faint");
  drawing.circle({0.0, 0.0}, CalibrationVolume{}.radius_mm, "");
  drawing.line({-4.0, 0.0}, {4.0, 0.0}, "");
  drawing.line({0.0, -4.0}, {0.0, 4.0}, "");
  return drawing;
}

Drawing VolumeViews::side(double table_radius_mm) const {
  const CalibrationVolume volume;
  Drawing drawing(window_side());
  if (table_radius_mm > 0.0) drawing.line({-table_radius_mm, 0.0}, {table_radius_mm, 0.0}, "");
  drawing.line({0.0, volume.min_height_mm}, {0.0, volume.max_height_mm}, "faint");
  drawing.box({-volume.radius_mm, volume.min_height_mm}, {volume.radius_mm, volume.max_height_mm}, "line");
  return drawing;
}

}  // namespace scanrig::report
