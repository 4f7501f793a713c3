#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "daemon/jobs/job_store.h"
#include "daemon/jobs/reconstructor.h"
#include "pipeline/calibrate/find_boards.h"

namespace scanrig {

/// The good views of a calibration, by placement and view, and what they show.
struct CalibrationViews {
  bool is_check = false;  ///< compared with the calibration of the job's folder, instead of solved anew
  CalibrationImages images;
  FoundBoards boards;
};

/// A solved calibration, or the result of a check.
struct CalibrationResult {
  std::string grade = "refused";         ///< "A", "B", "C", or "refused": it must not be used
  std::string verdict{};                 ///< of a check, as CalibrationOutcome::verdict
  std::vector<std::string> sentences{};  ///< for the person who accepts it, or why it is refused
  std::string html{};                    ///< a report on it, also of one that is refused; of a check: empty
  std::string file{};                    ///< text of its calibration.json; of a check that holds: as it was
};

/// Solves a calibration, or checks one. What else it needs (board, measured length) it has already. Threads: any.
using CalibrationSolver = std::function<Result<CalibrationResult>(CalibrationViews, const Context&)>;

struct CalibratorOptions {
  Board board{};
  CameraSerials cameras{};     ///< the rig's
  CalibrationSolver solver{};  ///< empty: no calibration can begin
};

struct CalibrationTask {
  std::filesystem::path folder;  ///< of the job
  bool is_check = false;
  /// Called for each view when its images were examined, with what is wrong with them.
  std::function<void(int pose, int view, std::vector<std::string> problems)> report;
};
using CalibratorFactory = std::function<std::unique_ptr<Reconstructor>(const CalibrationTask&)>;

/// Makes calibrations instead of models: add_view() finds the board in both images. finish() solves, and writes
/// calibration.json and report.json; it fails with `below_limits` where the grade is "refused". The
/// report is calibration.html in the job's folder. A check that holds is noted for the reminder.
CalibratorFactory calibrator(CalibratorOptions options);

}  // namespace scanrig
