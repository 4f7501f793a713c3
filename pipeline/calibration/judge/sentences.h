#pragma once

#include <string>
#include <vector>

#include "pipeline/calibration/judge/judge_calibration.h"

namespace scanrig {

/// A fault of the set-up that no number of images mends: cameras swapped, table turning the other way or by another
/// gear, two lengths that contradict each other, a camera that moved by more than 0.5 px.
bool is_to_be_refused(const CalibrationInput& input, const SolvedCalibration& solved,
                      const CalibrationJudgement& judgement);

/// An image's cells that have corners of the images used, of kCoverageColumns x kCoverageRows.
inline constexpr int kCoverageColumns = 8, kCoverageRows = 6;
int covered_cells(const CalibrationInput& input, const SolvedCalibration& solved, int camera);

/// What the operator is told, most important first.
std::vector<std::string> calibration_sentences(const CalibrationInput& input, const SolvedCalibration& solved,
                                               const CalibrationJudgement& judgement);

}  // namespace scanrig
