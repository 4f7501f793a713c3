#pragma once

#include <vector>

#include "core/result.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/corners/board_map.h"
#include "pipeline/calibration/corners/corner_image.h"

namespace scanrig {

/// Roughly where a board is in an image.
struct BoardSeed {
  BoardMap map;
  BoardParity parity = BoardParity::upper_left_black;
  int markers = 0;  ///< that agree; 0 on a plain chessboard
};

/// From the markers. Their layout is fitted under both parities; the one that fits counts. Fails with
/// - `not_found`: fewer than 4 markers seen;
/// - `invalid_input`: markers of another board, with what is seen of it;
/// - `ambiguous`: too few markers to tell the two parities apart.
Result<BoardSeed> seed_from_markers(const CornerImage& image, const Board& board);

/// From OpenCV's chessboard detection: the whole board must be visible. The upper left square is the black one of the
/// board's ends; where both ends are alike (columns + rows even), the one for which x points right in the image. Fails
/// with `not_found` and, when a board of other size is found, with `invalid_input`.
Result<BoardSeed> seed_from_chessboard(const CornerImage& image, const Board& board);

}  // namespace scanrig
