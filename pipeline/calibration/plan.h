#pragma once

#include <vector>

namespace scanrig {

/// One place of the calibration board on the table. The table turns about it; the board stays.
struct Placement {
  int number = 1;          ///< from 1
  bool in_a = true;        ///< takes part in calibration A, of A against B
  bool in_b = false;       ///< likewise B
  bool portrait = false;   ///< its columns upright
  double tilt_deg = 60.0;  ///< of the print, from flat on its back
  double front_mm = 0.0;   ///< of its middle before the axis, towards the cameras; negative: behind
  bool on_block = false;   ///< its lower edge stands on a block of kBlockHeightMm
  double mark_deg = 0.0;   ///< of the table's scale, the mark that the board faces

  [[nodiscard]] bool is_flat() const { return tilt_deg == 0.0; }
};

constexpr double kBlockHeightMm = 40.0;

/// How far from its plan a board may stand.
constexpr double kMaxPlacementErrorDeg = 10.0, kMaxPlacementErrorMm = 15.0;

constexpr int kPlacementViews = 7;  ///< of a placement; a flat one has one more
constexpr int kCheckViews = 6;      ///< of the first placement, for a check of a calibration
/// Good views, below which a placement is taken again. A flat board, seen at a low angle, is often hard to read.
constexpr int kMinPlacementViews = 5, kMinFlatViews = 3;

/// The seven placements: together they fill the volume, front and back, low and high.
const std::vector<Placement>& calibration_plan();

/// Table angle at which the board of a placement faces the cameras.
double facing_deg(const Placement& placement);

/// Table angles of the views of a placement, within +-180: `count` over +-56 degrees around facing_deg(); of a flat one
/// `count` + 1 over the turn.
std::vector<double> placement_angles(const Placement& placement, int count = kPlacementViews);

}  // namespace scanrig
