#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"

namespace scanrig {

struct CornerOptions {
  double radius_px = 6.0;       ///< of the pixels a corner is fitted to
  double max_shift_px = 3.0;    ///< from where the markers place the corner
  double max_residual = 0.12;   ///< what the fit leaves, as a share of its contrast; 3 times the image's median counts
  double max_saturated = 0.15;  ///< share of a corner's pixels
  double max_misfit_px = 0.3;   ///< from a smooth map through all corners; 6 sigma counts
  int min_corners = 8;
};

/// Corners of the board that were left out, by reason.
struct LostCorners {
  int outside = 0;        ///< of the image
  int glared = 0;         ///< saturated
  int occluded = 0;       ///< something else is there, or the wrong colours are
  int not_converged = 0;  ///< no sharp crossing of two edges
};

/// A board as one image shows it.
struct BoardFinding {
  std::vector<CornerObservation> corners;  ///< ascending id
  LostCorners lost;
  BoardParity parity = BoardParity::upper_left_black;  ///< as seen; corner ids do not depend on it
  Eigen::Matrix3d pixel_from_board;                    ///< homography of board mm (x, y) to pixels, lens ignored
  std::array<Eigen::Vector2d, 4>
      outline;                   ///< pixels of the print's ends: upper left, upper right, lower right, lower left
  double square_px = 0.0;        ///< shortest side of a square, median over the corners
  double blur_px = 0.0;          ///< median of the corners' blur
  double contrast = 0.0;         ///< half of white minus black, grey levels, median
  double noise = 0.0;            ///< what the fits leave, grey levels, median
  double saturated_share = 0.0;  ///< of the pixels within the outline
};

/// Finds the corners of `board` in a raw image. Markers (OpenCV's) place the board; each corner is then fitted to the
/// pixels as the sensor measured them, gain and offset per Bayer colour. Part of a board with markers is enough; a
/// plain chessboard must be visible as a whole. `pixel_format`: "Mono8", "BayerRG8" or "BGR8", as in manifests. Pixel
/// centres are at integer coordinates. Same image, same bits. Threads: any. Fails with
/// - `invalid_input`: an image that is not of its format, a board that cannot be, another board than `board`;
/// - `not_found`: no board, or fewer than `min_corners` corners;
/// - `ambiguous`: too little of the board is visible to place it;
/// - `internal`: OpenCV failed.
Result<BoardFinding> find_board(const cv::Mat& image, const std::string& pixel_format, const Board& board,
                                const CornerOptions& options = {});

}  // namespace scanrig
