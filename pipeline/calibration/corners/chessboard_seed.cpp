#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/calibration/corners/board_seed.h"

namespace scanrig {
namespace {

using Grid = std::vector<cv::Point2f>;  // row after row

/// Empty: not found.
Grid find_grid(const cv::Mat1b& grey, cv::Size corners, bool is_thorough) {
  Grid grid;
  const int classic = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (cv::findChessboardCorners(grey, corners, grid, classic)) return grid;
  if (is_thorough && cv::findChessboardCornersSB(grey, corners, grid, cv::CALIB_CB_NORMALIZE_IMAGE)) return grid;
  return {};
}

Eigen::Vector2d to_eigen(const cv::Point2f& p) { return {p.x, p.y}; }

/// Grey on one diagonal of the squares around the first corner minus that on the other: positive when the upper left
/// square is white.
double upper_left_minus_neighbours(const cv::Mat1b& grey, const Grid& grid, int columns) {
  const Eigen::Vector2d origin = to_eigen(grid[0]);
  const Eigen::Vector2d x = to_eigen(grid[1]) - origin;
  const Eigen::Vector2d y = to_eigen(grid[static_cast<std::size_t>(columns)]) - origin;
  double difference = 0.0;
  for (const double a : {-0.5, 0.5}) {
    for (const double b : {-0.5, 0.5}) {
      const Eigen::Vector2d at = origin + a * x + b * y;
      const int u = std::clamp(static_cast<int>(std::lround(at.x())), 0, grey.cols - 1);
      const int v = std::clamp(static_cast<int>(std::lround(at.y())), 0, grey.rows - 1);
      difference += (a * b > 0.0 ? 1.0 : -1.0) * grey(v, u);
    }
  }
  return difference;
}

/// Row after row as the board's ids; see seed_from_chessboard().
BoardParity put_in_order(const cv::Mat1b& grey, const Board& board, Grid& grid) {
  const int columns = board.corner_columns();
  const Eigen::Vector2d x = to_eigen(grid[1]) - to_eigen(grid[0]);
  const Eigen::Vector2d y = to_eigen(grid[static_cast<std::size_t>(columns)]) - to_eigen(grid[0]);
  if (x.x() * y.y() - x.y() * y.x() < 0.0) {
    for (auto row = grid.begin(); row != grid.end(); row += columns) std::reverse(row, row + columns);
  }
  const bool ends_are_alike = (board.columns + board.rows) % 2 == 0;
  const bool is_white = upper_left_minus_neighbours(grey, grid, columns) > 0.0;
  const bool points_left = grid[static_cast<std::size_t>(columns) - 1].x < grid[0].x;
  if (ends_are_alike ? points_left : is_white) std::reverse(grid.begin(), grid.end());
  return ends_are_alike && is_white ? BoardParity::upper_left_white : BoardParity::upper_left_black;
}

Error name_other_grid(const cv::Mat1b& grey, const Board& board) {
  for (const auto& [wider, higher] : {std::pair{0, 1}, {0, -1}, {1, 0}, {-1, 0}}) {
    const cv::Size corners(board.corner_columns() + wider, board.corner_rows() + higher);
    if (corners.width < 3 || corners.height < 3 || find_grid(grey, corners, false).empty()) continue;
    const bool is_rows = wider == 0;
    return {ErrorCode::invalid_input,
            fmt::format("board: {} board {} seen, {} expected; use the configured board or correct its size",
                        is_rows ? board.rows + higher : board.columns + wider, is_rows ? "rows" : "columns",
                        is_rows ? board.rows : board.columns)};
  }
  return {ErrorCode::not_found,
          fmt::format("board: no chessboard of {} x {} squares seen; put all of it into view, check "
                      "light and focus",
                      board.columns, board.rows)};
}

}  // namespace

Result<BoardSeed> seed_from_chessboard(const CornerImage& image, const Board& board) {
  try {
    Grid grid = find_grid(image.grey, {board.corner_columns(), board.corner_rows()}, true);
    if (grid.empty()) return tl::unexpected<Error>(name_other_grid(image.grey, board));
    const BoardParity parity = put_in_order(image.grey, board, grid);
    std::vector<BoardPoint> points;
    for (int id = 0; id < board.corner_count(); ++id) {
      points.push_back({board.corner(id).head<2>(), to_eigen(grid[static_cast<std::size_t>(id)])});
    }
    const auto map = BoardMap::fit(points);
    if (!map) return fail(ErrorCode::not_found, "board: the chessboard's corners are on one line; turn the board");
    return BoardSeed{*map, parity, 0};
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "board: OpenCV's chessboard detection failed: {}", error.what());
  }
}

}  // namespace scanrig
