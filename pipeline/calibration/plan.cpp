#include "pipeline/calibration/plan.h"

#include <cmath>

namespace scanrig {

const std::vector<Placement>& calibration_plan() {
  static const std::vector<Placement> plan = {
      {.number = 1, .tilt_deg = 60, .front_mm = 35, .mark_deg = 0},
      {.number = 2, .tilt_deg = 60, .front_mm = -30, .on_block = true, .mark_deg = 120},
      {.number = 3, .tilt_deg = 30, .front_mm = 0, .mark_deg = 240},
      {.number = 4, .in_a = false, .in_b = true, .portrait = true, .tilt_deg = 45, .front_mm = 30, .mark_deg = 60},
      {.number = 5,
       .in_a = false,
       .in_b = true,
       .portrait = true,
       .tilt_deg = 40,
       .front_mm = -10,
       .on_block = true,
       .mark_deg = 180},
      {.number = 6, .in_a = false, .in_b = true, .tilt_deg = 75, .front_mm = -35, .mark_deg = 300},
      {.number = 7, .in_b = true, .tilt_deg = 0, .front_mm = 0, .mark_deg = 0}};
  return plan;
}

double facing_deg(const Placement& placement) { return std::remainder(-placement.mark_deg, 360.0); }

std::vector<double> placement_angles(const Placement& placement, int count) {
  constexpr double kHalfRangeDeg = 56.0;
  const int views = placement.is_flat() ? count + 1 : count;
  std::vector<double> angles;
  for (int i = 0; i < views; ++i) {
    const double share = views > 1 ? 2.0 * i / (views - 1) - 1.0 : 0.0;
    const double off = placement.is_flat() ? 360.0 * i / views : kHalfRangeDeg * share;
    angles.push_back(std::remainder(facing_deg(placement) + off, 360.0));
  }
  return angles;
}

}  // namespace scanrig
