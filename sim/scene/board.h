#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/scene/named_values.h"

namespace scanrig::sim {

/// A calibration board as ordered: black and white squares with a black one at the upper left, and in the white ones
/// markers of DICT_4X4_100, upright, by id from the upper left, row after row. Lengths in mm.
struct BoardLayout {
  int columns = 12;  ///< squares
  int rows = 9;      ///< squares; odd for markers, so that every version of OpenCV has the same layout
  double square_mm = 10.0;
  double marker_mm = 6.0;  ///< 0: a plain chessboard
  double margin_mm = 3.0;  ///< white, around the squares
  double thickness_mm = 3.0;

  [[nodiscard]] int corner_columns() const { return columns - 1; }
  [[nodiscard]] int corner_count() const { return (columns - 1) * (rows - 1); }
  [[nodiscard]] int marker_count() const { return marker_mm > 0.0 ? columns * rows / 2 : 0; }
  [[nodiscard]] double width() const { return columns * square_mm + 2.0 * margin_mm; }
  [[nodiscard]] double height() const { return rows * square_mm + 2.0 * margin_mm; }
  /// Inner corner `id` from the upper left one, row after row: x right, y down, from the middle of the print.
  [[nodiscard]] Eigen::Vector2d corner(int id) const;
};

/// How the print departs from the order. Sigma, unless stated otherwise.
struct PrintErrors {
  double corner_mm = 0.008;   ///< each corner, each way
  double scale = 0.0;         ///< exactly, beside the drawn one: 0.003 is a board 0.3 % too large
  double scale_sigma = 2e-4;  ///< drawn
  double aspect = 1e-4;       ///< height against width
  double shear = 5e-5;
  double warp_mm = 0.1;  ///< largest height of the quadratic warp over the print, exactly
  double dirt = 12.0;    ///< number of spots
  double glare = 0.0;    ///< 1: as glossy as a laminated sheet; 0: matte
};

inline constexpr std::array<NamedValue<PrintErrors>, 8> kPrintErrorNames = {{
    {"corner", &PrintErrors::corner_mm},
    {"scale", &PrintErrors::scale},
    {"scale-sigma", &PrintErrors::scale_sigma},
    {"aspect", &PrintErrors::aspect},
    {"shear", &PrintErrors::shear},
    {"warp", &PrintErrors::warp_mm},
    {"dirt", &PrintErrors::dirt},
    {"glare", &PrintErrors::glare},
}};

/// One printed board. Its frame, seen by who reads the print: x right, y down, z into the board, origin in the middle
/// of the print; millimetres.
/// Threads: const functions from any.
class PrintedBoard {
 public:
  /// `layout`: with markers, an odd number of rows and at most 200 squares. Same seed, same print.
  PrintedBoard(const BoardLayout& layout, const PrintErrors& errors, std::uint64_t seed);

  [[nodiscard]] const BoardLayout& layout() const { return layout_; }
  [[nodiscard]] const PrintErrors& errors() const { return errors_; }
  /// Where inner corner `id` is.
  [[nodiscard]] Eigen::Vector3d corner(int id) const;
  /// z of the surface at (x, y).
  [[nodiscard]] double warp(double x, double y) const;
  struct Print {
    Eigen::Vector3f albedo;  ///< linear RGB
    bool even;               ///< the same all over the averaged area
  };
  /// The print at `at`, averaged by a Gaussian of `sigma` mm along x and y.
  [[nodiscard]] Print print(const Eigen::Vector2d& at, const Eigen::Vector2d& sigma) const;

 private:
  /// Cells of the print that an interval covers along one axis, with the share of each.
  struct Cover;
  struct Spot {
    Eigen::Vector2d centre;
    double radius, edge, darkness;
  };
  void print_markers();
  [[nodiscard]] Cover cover(double at, double sigma, int squares) const;
  [[nodiscard]] bool is_black(int column, int row) const;
  [[nodiscard]] Eigen::Vector2d displacement(const Eigen::Vector2d& ordered) const;
  /// Where on the ordered layout a point of the print belongs.
  [[nodiscard]] Eigen::Vector2d ordered(const Eigen::Vector2d& printed) const;

  BoardLayout layout_;
  PrintErrors errors_;
  Eigen::Matrix2d printed_from_ordered_;
  Eigen::Matrix2d ordered_from_printed_;
  Eigen::Matrix2d warp_;                    // z = p' warp p
  std::vector<Eigen::Vector2d> displaced_;  // by corner
  std::vector<char> black_;                 // by cell, row after row; eight cells a square along each axis
  std::array<double, 9> edges_{};           // of a square's cells, mm from the square's edge
  std::vector<Spot> dirt_;
};

}  // namespace scanrig::sim
