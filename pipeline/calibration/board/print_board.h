#pragma once

#include <string>

#include "core/result.h"
#include "pipeline/calibration/board/board.h"

namespace scanrig {

struct PageOptions {
  double width_mm = 297.0;  ///< A4 landscape
  double height_mm = 210.0;
  double margin_mm = 5.0;  ///< what a printer leaves blank
};

/// The board as a PDF page to scale: the board, two length marks with their nominal length, and a line of text by which
/// the print can be checked. The length marks are as long as the board is wide and high; their distances are from
/// centre to centre of their thin lines.
/// Same bytes for the same board. Fails with `invalid_input` for a board that cannot be and for a page too small.
Result<std::string> print_board(const Board& board, const PageOptions& page = {});

/// The text line of the print: squares, marker size, dictionary, scale and marks. ASCII.
std::string board_check_line(const Board& board);

}  // namespace scanrig
