#pragma once

#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "pipeline/calibration/corners/find_board.h"

namespace scanrig {

struct ImageLimits {
  double max_blur_px = 1.6;           ///< sigma of the edges
  double max_saturated_share = 0.01;  ///< of the board
  double min_square_px = 15.0;        ///< shortest side of a square
  double min_corner_share = 0.6;      ///< of the board's corners
};

enum class ImageProblem { blurred, glare, cut_off, too_small, hidden };

struct ImageCheck {
  ImageProblem problem = ImageProblem::blurred;
  std::string message;          ///< for the operator: one sentence, what happened and what to do
  std::string remark;           ///< for a report on an image that is used all the same: what happened
  bool spoils_corners = false;  ///< they are not where the board's are
  bool is_minor = false;        ///< said, but the image is good
};

/// What is wrong with an image of a calibration board; empty: nothing. Threads: any.
std::vector<ImageCheck> check_board_image(const BoardFinding& finding, const Board& board, cv::Size image,
                                          const ImageLimits& limits = {});

}  // namespace scanrig
