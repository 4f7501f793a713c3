#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"
#include "pipeline/calibrate/report/sections.h"

namespace scanrig::report {
namespace {

constexpr double kPpm = 1e6;

/// Height of a corner over the board's plane, mm: warp and its own offset. Positive: away from the reader.
double height_of(const Board& board, const SolvedBoard& solved, int id) {
  const Eigen::Vector3d place = board.corner(id);
  const double x = place.x() / (0.5 * (board.corner_columns() - 1) * board.square_mm);
  const double y = place.y() / (0.5 * (board.corner_rows() - 1) * board.square_mm);
  return solved.warp_mm[0] * x * x + solved.warp_mm[1] * x * y + solved.warp_mm[2] * y * y +
         solved.offsets_mm[static_cast<std::size_t>(id)][2];
}

Window window_of(const Board& board) {
  const double x = 0.5 * board.columns * board.square_mm, y = 0.5 * board.rows * board.square_mm;
  return {.left = -x, .right = x, .top = -y, .bottom = y, .width_px = 500.0};
}

std::string print_errors(const Board& board, const SolvedBoard& solved) {
  const Window window = window_of(board);
  double largest = 1e-9;
  for (const auto& offset : solved.offsets_mm) largest = std::max(largest, std::hypot(offset[0], offset[1]));
  const double exaggeration = round_down(1.2 * board.square_mm / largest);
  std::vector<Arrow> arrows;
  std::vector<Eigen::Vector2d> corners;
  for (int id = 0; id < board.corner_count(); ++id) {
    const auto& offset = solved.offsets_mm[static_cast<std::size_t>(id)];
    corners.emplace_back(board.corner(id).head<2>());
    arrows.push_back({corners.back(), exaggeration * Eigen::Vector2d(offset[0], offset[1])});
  }
  Drawing drawing(window);
  drawing.box({window.left, window.top}, {window.right, window.bottom}, "frame");
  drawing.dots(corners, "c0");
  drawing.arrows(arrows, "");
  const double key_um = round_down(kMicrometresPerMm * board.square_mm / exaggeration);
  return figure(
      drawing.svg() + arrow_key(window, key_um / kMicrometresPerMm, exaggeration, fmt::format("{:.4g} um", key_um)),
      fmt::format("errors of the print in its plane, drawn {:.6g} times too long; {} um at most", exaggeration,
                  number(kMicrometresPerMm * largest, 1)));
}

std::string flatness(const Board& board, const SolvedBoard& solved) {
  std::vector<double> heights;
  double mean = 0.0, largest = 1e-9;
  for (int id = 0; id < board.corner_count(); ++id) heights.push_back(height_of(board, solved, id));
  for (const double height : heights) mean += height / static_cast<double>(heights.size());
  for (const double height : heights) largest = std::max(largest, std::abs(height - mean));
  Drawing drawing(window_of(board));
  const Eigen::Vector2d half(0.5 * board.square_mm, 0.5 * board.square_mm);
  for (int id = 0; id < board.corner_count(); ++id) {
    const Eigen::Vector2d at = board.corner(id).head<2>();
    const double height = heights[static_cast<std::size_t>(id)] - mean, share = height / largest;
    drawing.box(at - half, at + half, "cell", signed_shade(share));
    drawing.text(at + Eigen::Vector2d(0.0, 1.2), number(kMicrometresPerMm * height, 0),
                 std::abs(share) > 0.75 ? "middle light" : "middle");
  }
  return figure(drawing.svg(),
                fmt::format("height of the corners over their mean, um: warp and print together, {} at most; positive: "
                            "away from who reads the print",
                            number(kMicrometresPerMm * largest, 0)));
}

std::string lengths_of(const CalibrationInput& input) {
  const auto words = [](const std::optional<MeasuredLength>& length) {
    if (!length) return std::string("none");
    return fmt::format("{} mm measured, sigma {} mm, {} mm ordered", number(length->measured_mm, 4),
                       number(length->sigma_mm, 4), number(length->nominal_mm, 3));
  };
  return table({"length", "is"}, {{"fixes the scale", words(input.length)}, {"compared", words(input.second_length)}});
}

}  // namespace

std::string board_section(const FolderCalibration& outcome) {
  const Board& board = outcome.input.board;
  const SolvedBoard& solved = outcome.judged.solved.board;
  std::vector<double> plane, across;
  for (const auto& offset : solved.offsets_mm) {
    plane.push_back(std::hypot(offset[0], offset[1]));
    across.push_back(offset[2]);
  }
  std::string out =
      paragraph(fmt::format("{} x {} squares of {} mm, as solved against the board as ordered, seen by who "
                            "reads its print.",
                            board.columns, board.rows, number(board.square_mm, 3)));
  out +=
      table({"what", "is"},
            {{"scale", fmt::format("{} ppm from the order, sigma {} ppm", number(kPpm * (solved.scale - 1.0), 0),
                                   number(kPpm * solved.scale_sigma, 0))},
             {"aspect", fmt::format("{} ppm", number(kPpm * solved.aspect, 0))},
             {"shear", fmt::format("{} ppm", number(kPpm * solved.shear, 0))},
             {"warp at the edge", fmt::format("{}, {}, {} mm, of x x, x y, y y", number(solved.warp_mm[0], 3),
                                              number(solved.warp_mm[1], 3), number(solved.warp_mm[2], 3))},
             {"print, in the plane", fmt::format("{} um rms", number(kMicrometresPerMm * root_mean_square(plane), 1))},
             {"print, across it", fmt::format("{} um rms", number(kMicrometresPerMm * root_mean_square(across), 1))}});
  out += lengths_of(outcome.input);
  if (solved.offsets_mm.size() == static_cast<std::size_t>(board.corner_count())) {
    out += row_of(print_errors(board, solved) + flatness(board, solved));
  }
  return section("Board", out);
}

}  // namespace scanrig::report
