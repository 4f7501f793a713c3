#pragma once

#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/calibration/observations.h"

namespace scanrig {

/// What a drift check says. holds: within 10 um over the working volume; moved: to 30 um, the new poses can replace the
/// old ones; calibrate: further off.
enum class DriftVerdict { holds, moved, calibrate };
std::string_view to_string(DriftVerdict verdict);

/// A calibration compared with a few images of its board on the table.
struct DriftCheck {
  DriftVerdict verdict = DriftVerdict::calibrate;
  double difference_um = 0.0;  ///< rms over the working volume; scale and base taken off
  double sigma_um = 0.0;       ///< of that, from these images alone
  Eigen::Vector2d cameras_px;  ///< shift of the right image against the left one: along and across rows
  double axis_mm = 0.0;        ///< shift of the table's axis against the left camera, half-way up the volume
  double axis_deg = 0.0;       ///< its tilt
  double noise_px = 0.0;       ///< sigma of a corner's coordinate
  Calibration calibration;     ///< as before, with the poses that the images show
  std::vector<std::string> sentences;
};

/// Finds where the cameras are, from pairs of one placement with at least 4 table angles; lenses and the board's print
/// are held as `known` has them. Scale and height over the table stay as they were: one placement shows neither.
/// Threads: one. Same input, same bits. Fails with `unsupported` (a calibration that does not have the board's print:
/// version 1, or of another board), `degenerate` (too few images, no convergence, a board that moved), `stopped`.
Result<DriftCheck> check_drift(const Calibration& known, const Board& board, const std::vector<BoardPair>& pairs,
                               const Context& context = {});

}  // namespace scanrig
