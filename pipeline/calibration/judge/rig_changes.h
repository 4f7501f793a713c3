#pragma once

#include <optional>

#include "pipeline/calibration/judge/judge_calibration.h"
#include "pipeline/calibration/solve/solution.h"

namespace scanrig {

/// The motion of a camera between two placements, or of a board within one, that explains most of what the solution
/// leaves over: a score test against all unknowns. None: nothing over 0.01 px with a chi-square over 40.
std::optional<RigChange> find_change(const CalibrationInput& input, const CalibrationSolution& solution);

}  // namespace scanrig
