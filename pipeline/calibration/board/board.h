#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// What a board is made of: how far it may depart from its nominal print.
enum class BoardKind { glass, paper };

/// The marker part of a ChArUco board.
struct BoardMarkers {
  double size_mm = 6.0;
  std::string dictionary = "4x4_100";  ///< OpenCV's predefined one, DICT_4X4_100
};

/// A printed calibration board, as ordered: its nominal corners. How the print departs from them is solved for.
/// Board frame, as seen by who reads its print: x right along a row of squares, y down along a column, z away from the
/// reader, into the board; the corners lie in z = 0, origin in the middle between the outermost of them. Millimetres.
struct Board {
  int columns = 12;  ///< squares
  int rows = 9;      ///< squares; odd, so that every version of OpenCV has the same layout
  double square_mm = 10.0;
  std::optional<BoardMarkers> markers = BoardMarkers{};  ///< none: a plain chessboard
  double thickness_mm = 3.0;                             ///< from the printed side to the side it lies on

  [[nodiscard]] int corner_columns() const { return columns - 1; }
  [[nodiscard]] int corner_rows() const { return rows - 1; }
  [[nodiscard]] int corner_count() const { return corner_columns() * corner_rows(); }
  /// Corner `id`, as ordered: 0 is the upper left one, row after row.
  [[nodiscard]] Eigen::Vector3d corner(int id) const;
  /// Point on the print at `column` and `row`, in squares from the upper left edge of the print.
  [[nodiscard]] Eigen::Vector2d at(double column, double row) const;
};

/// Colour of the upper left square. Ours is black; older versions of OpenCV start with white when `rows` is even.
/// Markers are in the white squares, numbered row after row.
enum class BoardParity { upper_left_black, upper_left_white };

bool is_white_square(int column, int row, BoardParity parity);

struct MarkerCell {
  int id = 0;
  int column = 0;  ///< of its square
  int row = 0;
};

/// The square of marker `id` on a board with `columns` squares in a row, however many rows it has.
MarkerCell marker_cell(int id, int columns, BoardParity parity);

/// Cells of all markers, by id; empty for a plain chessboard.
std::vector<MarkerCell> marker_cells(const Board& board, BoardParity parity = BoardParity::upper_left_black);

/// Corners of a marker on the print, mm, in OpenCV's order: upper left, upper right, lower right, lower left.
std::array<Eigen::Vector2d, 4> marker_corners(const Board& board, const MarkerCell& cell);

/// Fails with `invalid_input` for a board that cannot be: fewer than 3 x 3 squares, a marker larger than its square, an
/// unknown dictionary or one with too few markers.
Result<void> check_board(const Board& board);

}  // namespace scanrig
