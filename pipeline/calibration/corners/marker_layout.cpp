#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/mat.hpp>

#include "pipeline/calibration/board/markers.h"
#include "pipeline/calibration/corners/board_seed.h"

namespace scanrig {
namespace {

constexpr int kMinMarkers = 4;
constexpr double kMinAgreeing = 0.8;  // share of the markers seen
constexpr double kBlurred = 1.25;     // px, of an image whose markers are not read
constexpr int kMaxColumns = 30;       // tried when the configured number does not fit

/// Markers under the assumption of one layout.
struct LayoutFit {
  std::optional<BoardMap> map;
  BoardParity parity = BoardParity::upper_left_black;
  std::vector<MarkerCell> agreeing;
  std::vector<BoardPoint> points;  // of the agreeing markers
};

double side_px(const FoundMarker& marker) {
  return 0.25 * ((marker.corners[1] - marker.corners[0]).norm() + (marker.corners[2] - marker.corners[1]).norm() +
                 (marker.corners[3] - marker.corners[2]).norm() + (marker.corners[0] - marker.corners[3]).norm());
}

double tolerance_px(const std::vector<FoundMarker>& markers) {
  double sum = 0.0;
  for (const FoundMarker& marker : markers) sum += side_px(marker);
  return 1.5 + 0.08 * sum / static_cast<double>(markers.size());
}

LayoutFit fit_layout(const std::vector<FoundMarker>& markers, const Board& board, BoardParity parity) {
  LayoutFit fit;
  fit.parity = parity;
  std::vector<BoardPoint> points;
  for (const FoundMarker& marker : markers) {
    const auto corners = marker_corners(board, marker_cell(marker.id, board.columns, parity));
    for (std::size_t k = 0; k < 4; ++k) points.push_back({corners[k], marker.corners[k]});
  }
  const double tolerance = tolerance_px(markers);
  fit.map = BoardMap::fit_robustly(points, tolerance);
  if (!fit.map) return fit;
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(4 * i);
    const bool agrees = std::all_of(first, first + 4, [&](const BoardPoint& point) {
      return (fit.map->pixel(point.on_board) - point.pixel).norm() < 2.0 * tolerance;
    });
    if (!agrees) continue;
    fit.agreeing.push_back(marker_cell(markers[i].id, board.columns, parity));
    fit.points.insert(fit.points.end(), first, first + 4);
  }
  return fit;
}

bool fits(const LayoutFit& fit, std::size_t markers) {
  return fit.map && static_cast<int>(fit.agreeing.size()) >= kMinMarkers &&
         static_cast<double>(fit.agreeing.size()) >= kMinAgreeing * static_cast<double>(markers);
}

int rows_seen(const LayoutFit& fit) {
  int rows = 0;
  for (const MarkerCell& cell : fit.agreeing) rows = std::max(rows, cell.row + 1);
  return rows;
}

/// Side of the markers by the image, mm: the layout is fitted to their centres only. 0: does not fit.
double marker_size_seen(const std::vector<FoundMarker>& markers, const Board& board, BoardParity parity) {
  std::vector<BoardPoint> centres;
  for (const FoundMarker& marker : markers) {
    const MarkerCell cell = marker_cell(marker.id, board.columns, parity);
    centres.push_back({board.at(cell.column + 0.5, cell.row + 0.5),
                       0.25 * (marker.corners[0] + marker.corners[1] + marker.corners[2] + marker.corners[3])});
  }
  const auto map = BoardMap::fit_robustly(centres, tolerance_px(markers));
  if (!map) return 0.0;
  double ratio = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < markers.size(); ++i) {
    if ((map->pixel(centres[i].on_board) - centres[i].pixel).norm() > tolerance_px(markers)) continue;
    const Eigen::Matrix2d jacobian = map->jacobian(centres[i].on_board);
    ratio += side_px(markers[i]) / (0.5 * (jacobian.col(0).norm() + jacobian.col(1).norm()));
    ++count;
  }
  if (count < kMinMarkers || count < kMinAgreeing * static_cast<double>(markers.size())) return 0.0;
  return ratio / count;
}

/// What the markers are, when they are not those of `board`.
Error name_other_board(const std::vector<FoundMarker>& markers, const Board& board) {
  constexpr std::array parities = {BoardParity::upper_left_black, BoardParity::upper_left_white};
  for (int columns = 3; columns <= kMaxColumns; ++columns) {
    Board other = board;
    other.columns = columns;
    for (const BoardParity parity : parities) {
      if (columns == board.columns || !fits(fit_layout(markers, other, parity), markers.size())) continue;
      return {ErrorCode::invalid_input,
              fmt::format("board: {} board columns seen, {} expected; use the configured board "
                          "or correct its size",
                          columns, board.columns)};
    }
  }
  for (const BoardParity parity : parities) {
    const double size = marker_size_seen(markers, board, parity);
    if (size <= 0.0 || std::abs(size - board.markers->size_mm) < 0.05 * board.markers->size_mm) continue;
    return {ErrorCode::invalid_input,
            fmt::format("board: markers are {:.1f} mm by the image, {:g} mm expected; use the "
                        "configured board or correct its marker size",
                        size, board.markers->size_mm)};
  }
  return {ErrorCode::invalid_input, fmt::format("board: {} markers seen, but not in the places of a {} x {} board; use "
                                                "the configured board",
                                                markers.size(), board.columns, board.rows)};
}

double mean_grey(const CornerImage& image, const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  if (x < 2 || y < 2 || x >= image.width() - 2 || y >= image.height() - 2) return -1.0;
  double sum = 0.0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += image.grey(y + dy, x + dx);
  }
  return sum / 9.0;
}

/// Whether the image shows no squares where `row` should be, all of it within view.
bool is_row_missing(const CornerImage& image, const Board& board, const LayoutFit& fit, int row) {
  int alternating = 0;
  for (int column = 0; column + 1 < board.columns; ++column) {
    const double here = mean_grey(image, fit.map->pixel(board.at(column + 0.5, row + 0.1)));
    const double next = mean_grey(image, fit.map->pixel(board.at(column + 1.5, row + 0.1)));
    if (here < 0.0 || next < 0.0) return false;
    const bool is_white = is_white_square(column, row, fit.parity);
    if ((is_white ? here - next : next - here) > 15.0) ++alternating;
  }
  return alternating < board.columns / 3;
}

/// A board with fewer rows has all its markers seen, and none of the rows below.
int rows_of_smaller_board(const CornerImage& image, const Board& board, const LayoutFit& fit) {
  const int rows = rows_seen(fit);
  if (rows >= board.rows) return board.rows;
  Board smaller = board;
  smaller.rows = rows;
  const auto expected = marker_cells(smaller, fit.parity).size();
  if (static_cast<double>(fit.agreeing.size()) < 0.9 * static_cast<double>(expected)) return board.rows;
  for (int row = rows; row < board.rows; ++row) {
    if (!is_row_missing(image, board, fit, row)) return board.rows;
  }
  return rows;
}

}  // namespace

Result<BoardSeed> seed_from_markers(const CornerImage& image, const Board& board) {
  const auto markers = detect_markers(image.grey, board.markers->dictionary);
  if (!markers) return pass_on(markers);
  if (static_cast<int>(markers->size()) < kMinMarkers) {
    if (const auto edge = steepest_edge_px(image.grey); edge && *edge > kBlurred) {
      return fail(ErrorCode::not_found,
                  "board: image blurred ({:.1f} px), markers cannot be read; check focus and "
                  "aperture, and let the table settle",
                  *edge);
    }
    return fail(ErrorCode::not_found,
                "board: {} markers of {} seen, {} needed; put the board into view, check light and focus",
                markers->size(), board.markers->dictionary, kMinMarkers);
  }
  LayoutFit fit = fit_layout(*markers, board, BoardParity::upper_left_black);
  LayoutFit other = fit_layout(*markers, board, BoardParity::upper_left_white);
  if (other.agreeing.size() > fit.agreeing.size()) std::swap(fit, other);
  if (!fits(fit, markers->size())) return tl::unexpected<Error>(name_other_board(*markers, board));
  if (other.agreeing.size() + 2 > fit.agreeing.size()) {
    return fail(ErrorCode::ambiguous, "board: only {} markers seen, too few to place them; show more of the board",
                markers->size());
  }
  int rows = rows_seen(fit);
  if (rows <= board.rows) rows = rows_of_smaller_board(image, board, fit);
  if (rows != board.rows) {
    return fail(ErrorCode::invalid_input,
                "board: {} board rows seen, {} expected; use the configured board or correct its size", rows,
                board.rows);
  }
  const auto map = BoardMap::fit(fit.points);
  if (!map) return fail(ErrorCode::ambiguous, "board: the markers seen are on one line; show more of the board");
  return BoardSeed{*map, fit.parity, static_cast<int>(fit.agreeing.size())};
}

}  // namespace scanrig
