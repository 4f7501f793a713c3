#pragma once

#include <optional>

#include "pipeline/calibration/judge/judge_calibration.h"
#include "pipeline/calibration/solve/solution.h"

namespace scanrig {

/// The change of a camera, or the slip of a board, that explains most of what the solution leaves over: a score test
/// against all unknowns. None: nothing over 0.01 px with a chi-square over 40.
std::optional<RigChange> find_change(const CalibrationInput& input, const CalibrationSolution& solution);

/// The same for motions of several pixels, which no linear test finds: all images of a camera up to a placement, or
/// after it, were left out because they do not fit.
std::optional<RigChange> find_large_motion(const SolvedCalibration& solved);

}  // namespace scanrig
