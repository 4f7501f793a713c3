#pragma once

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/solve/calibration_input.h"
#include "pipeline/calibration/solve/solved_calibration.h"

namespace scanrig {

/// Solves cameras, lenses, table and board from pairs of images in one least-squares adjustment with all priors;
/// images that do not fit are named and left out. Model, frame and unknowns: docs/reference/calibration.md.
/// Same input, same bits; one thread, any. 50 pairs: seconds.
/// Fails with `invalid_input` (image size, focal length, ids, a length), `degenerate` (too few images, no common axis,
/// "singular": the images leave something open, more than a third of the images do not fit), `stopped`.
Result<SolvedCalibration> solve_calibration(const CalibrationInput& input, const Context& context = {});

}  // namespace scanrig
