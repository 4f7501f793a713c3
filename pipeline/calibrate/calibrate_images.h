#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/calibrate/find_boards.h"
#include "pipeline/calibration/judge/judge_calibration.h"

namespace scanrig {

/// What the images do not say themselves. Set members replace those of the folder's list.
struct CalibrateOptions {
  std::optional<Board> board;  ///< none here and in the list: the station's 12 x 9 board
  BoardKind board_kind = BoardKind::glass;
  std::optional<MeasuredLength> length;  ///< fixes the scale; none here and in the list (its first): grade C at best
  std::optional<MeasuredLength> second_length;  ///< of another instrument, only compared
  std::string pixel_format;                     ///< empty here and in the list: by the image's channels, Mono8 or BGR8
  double focal_px = 0.0;                        ///< nominal; 0 here and in the list: found in the images
  std::optional<RimDots> rim_dots;              ///< none here and in the list: not used
  double table_radius_mm = 0.0;                 ///< 0 here and in the list: 90
  double gear_ratio = 0.0;                      ///< for messages
  std::optional<bool> lens_field;               ///< none: by evidence
  int threads = 0;                              ///< 0: all of the machine's; the result is the same
};

/// A calibration from a folder of images, and what it came from.
struct FolderCalibration {
  CalibrationInput input;
  JudgedCalibration judged;
  FoundBoards boards;
};

/// Solves, measures the rim dots with that solution, solves again, judges. Reports the stage
/// "rim dots" and those of the solver. Same input, same bits, for any number of threads. Fails as solve_calibration().
Result<FolderCalibration> calibrate_boards(const CalibrationImages& images, FoundBoards boards,
                                           const CalibrateOptions& options = {}, const Context& context = {});

/// Finds the boards in the images, then calibrate_boards(). Reports the stage "boards" too. Fails as find_boards() too.
Result<FolderCalibration> calibrate_images(const CalibrationImages& images, const CalibrateOptions& options = {},
                                           const Context& context = {});

}  // namespace scanrig
