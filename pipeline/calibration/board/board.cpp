#include "pipeline/calibration/board/board.h"

#include "pipeline/calibration/board/markers.h"

namespace scanrig {

Eigen::Vector3d Board::corner(int id) const {
  const int column = id % corner_columns();
  const int row = id / corner_columns();
  return {(column - 0.5 * (corner_columns() - 1)) * square_mm, (row - 0.5 * (corner_rows() - 1)) * square_mm, 0.0};
}

Eigen::Vector2d Board::at(double column, double row) const {
  return {(column - 0.5 * columns) * square_mm, (row - 0.5 * rows) * square_mm};
}

bool is_white_square(int column, int row, BoardParity parity) {
  return ((column + row) % 2 != 0) == (parity == BoardParity::upper_left_black);
}

MarkerCell marker_cell(int id, int columns, BoardParity parity) {
  const int in_first_row = parity == BoardParity::upper_left_black ? columns / 2 : columns - columns / 2;
  const int pair = id / columns;  // two rows have as many markers as one row has squares
  const int rest = id % columns;
  const int row = 2 * pair + (rest < in_first_row ? 0 : 1);
  const int in_row = rest < in_first_row ? rest : rest - in_first_row;
  return {id, 2 * in_row + (is_white_square(0, row, parity) ? 0 : 1), row};
}

std::vector<MarkerCell> marker_cells(const Board& board, BoardParity parity) {
  std::vector<MarkerCell> cells;
  if (!board.markers) return cells;
  for (int id = 0;; ++id) {
    const MarkerCell cell = marker_cell(id, board.columns, parity);
    if (cell.row >= board.rows) return cells;
    cells.push_back(cell);
  }
}

std::array<Eigen::Vector2d, 4> marker_corners(const Board& board, const MarkerCell& cell) {
  const Eigen::Vector2d middle = board.at(cell.column + 0.5, cell.row + 0.5);
  const double half = board.markers ? 0.5 * board.markers->size_mm : 0.0;
  return {middle + Eigen::Vector2d(-half, -half), middle + Eigen::Vector2d(half, -half),
          middle + Eigen::Vector2d(half, half), middle + Eigen::Vector2d(-half, half)};
}

constexpr double kMaxSquareMm = 1000.0;

Result<void> check_board(const Board& board) {
  if (board.columns < 3 || board.rows < 3 || board.columns > 200 || board.rows > 200) {
    return fail(ErrorCode::invalid_input, "board: {} x {} squares; give 3 to 200 columns and rows", board.columns,
                board.rows);
  }
  if (!(board.square_mm > 0.0) || board.square_mm > kMaxSquareMm) {
    return fail(ErrorCode::invalid_input, "board: squares of {} mm; give more than 0 and at most {}", board.square_mm,
                kMaxSquareMm);
  }
  if (!board.markers) return {};
  if (!(board.markers->size_mm > 0.0) || !(board.markers->size_mm < board.square_mm)) {
    return fail(ErrorCode::invalid_input, "board: markers of {} mm do not fit squares of {} mm; make them smaller",
                board.markers->size_mm, board.square_mm);
  }
  const auto available = marker_count(board.markers->dictionary);
  if (!available) return pass_on(available);
  const auto needed = marker_cells(board).size();
  if (needed > static_cast<std::size_t>(*available)) {
    return fail(ErrorCode::invalid_input, "board: {} markers needed, dictionary {} has {}; use a larger one", needed,
                board.markers->dictionary, *available);
  }
  return {};
}

}  // namespace scanrig
