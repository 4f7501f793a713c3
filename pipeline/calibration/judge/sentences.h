#pragma once

#include <string>
#include <vector>

#include "pipeline/calibration/judge/judge_calibration.h"

namespace scanrig {

/// A fault of the set-up that no number of images mends: cameras swapped, table turning the other way or by another
/// gear, two lengths that contradict each other, a camera that moved by more than 0.5 px.
bool is_to_be_refused(const CalibrationInput& input, const SolvedCalibration& solved,
                      const CalibrationJudgement& judgement);

/// What the operator is told, most important first.
std::vector<std::string> calibration_sentences(const CalibrationInput& input, const SolvedCalibration& solved,
                                               const CalibrationJudgement& judgement);

}  // namespace scanrig
