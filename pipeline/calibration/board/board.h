#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

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
};

}  // namespace scanrig
