#pragma once

#include <optional>
#include <vector>

#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"

namespace scanrig {

/// A focal length, in pixels, from the perspective of the boards alone: a lens without distortion, square pixels and
/// the principal point in the middle of `width` x `height` pixels. Both cameras together. To a few percent, enough for
/// CalibrationInput::nominal_focal_px. Least squares over the two conditions of each board's homography [Zhang, A
/// Flexible New Technique for Camera Calibration, TPAMI 2000, section 3.1]. None: fewer than 2 boards, or boards that
/// all face the cameras.
std::optional<double> find_focal_px(const Board& board, const std::vector<BoardPair>& pairs, int width, int height);

}  // namespace scanrig
