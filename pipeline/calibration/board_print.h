#pragma once

#include <array>
#include <vector>

namespace scanrig {

/// How the print of a board departs from the order, as a calibration found it. Board frame: x right, y down, z into
/// the board, origin in the middle of the corners.
struct BoardPrint {
  double scale = 1.0;                             ///< printed over ordered length
  double scale_sigma = 0.0;                       ///< of the measured length: of all lengths alike; 0: not known
  double aspect = 0.0;                            ///< height against width
  double shear = 0.0;                             ///< radians
  std::array<double, 3> warp_mm{};                ///< at the board's edge: of x^2, x y, y^2
  std::vector<std::array<double, 3>> offsets_mm;  ///< of each corner beside these
};

}  // namespace scanrig
