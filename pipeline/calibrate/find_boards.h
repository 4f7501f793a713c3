#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"
#include "pipeline/storage/calibration_images.h"

namespace scanrig {

/// What is remarkable of one image.
struct ImageRemark {
  std::string pair;      ///< its name
  std::size_t side = 0;  ///< 0 left
  std::string message;   ///< of one that is left out: a sentence with what to do; else what is seen, in a few words
  bool is_left_out = false;
};

/// The boards of a folder of images.
struct FoundBoards {
  std::vector<BoardPair> pairs;  ///< as those of the folder; a side without a usable board has no corners
  std::vector<std::array<std::vector<Eigen::Vector2d>, 2>>
      outlines;   ///< of the board in each image, pixels; empty: none
  int width = 0;  ///< of every image
  int height = 0;
  std::vector<ImageRemark> remarks;
};

/// The remarks on images that are used, by what they say.
std::map<std::string, std::vector<ImageRemark>> remarks_on_used_images(const FoundBoards& boards);

/// Finds `board` in every image of the folder, on all threads. An image that cannot be read, shows no board, or is
/// blurred or glared is left out with a remark. Reports the stage "boards".
/// Fails with `invalid_input` (images of different sizes, another board than `board`), `not_found` (no board in any
/// image), `stopped`.
Result<FoundBoards> find_boards(const CalibrationImages& images, const std::string& pixel_format, const Board& board,
                                const Context& context = {});

}  // namespace scanrig
