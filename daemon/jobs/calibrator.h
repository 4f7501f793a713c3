#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "daemon/jobs/reconstructor.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"
#include "pipeline/calibration/plan.h"

namespace scanrig {

/// What the good views of a calibration show.
struct CalibrationViews {
  std::vector<BoardPair> pairs;  ///< by placement and view
  int width = 0;                 ///< of every image, pixels
  int height = 0;
};

/// A solved calibration.
struct CalibrationResult {
  std::string grade = "refused";         ///< "A", "B", "C", or "refused": it must not be used
  std::vector<std::string> sentences{};  ///< for the person who accepts it, or why it is refused
  std::string file{};                    ///< text of its calibration.json
};

/// Solves a calibration. Pure: the rest of what it needs (board, measured length, serial numbers) it has already.
using CalibrationSolver = std::function<Result<CalibrationResult>(const CalibrationViews&, const Context&)>;

struct CalibratorOptions {
  Board board{};
  CalibrationSolver solver{};  ///< empty: no calibration can begin
};

struct CalibrationTask {
  int min_views = kMinPlacementViews;  ///< good ones of each placement
  /// Called for each view when its images were examined, with what is wrong with them.
  std::function<void(int pose, int view, std::vector<std::string> problems)> report;
};
using CalibratorFactory = std::function<std::unique_ptr<Reconstructor>(const CalibrationTask&)>;

/// Makes calibrations instead of models: add_view() finds the board in both images. finish() solves, and writes
/// calibration.json and report.json; it fails with `below_limits` where the grade is "refused".
CalibratorFactory calibrator(CalibratorOptions options);

}  // namespace scanrig
