#pragma once

#include <memory>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/solve/normal_matrix.h"
#include "pipeline/calibration/solve/solved_calibration.h"
#include "pipeline/calibration/solve/start.h"

namespace scanrig {

/// A solved calibration with all that its judgement needs. Refers to the input it was solved from.
struct CalibrationSolution {
  UsedImages used;
  StartingPoint start;  ///< its unknowns are the solution
  Linearised linear;
  NormalMatrix normal;
  SolvedCalibration solved;
  /// The solution before images were left out, when many do not fit: what changed in the rig is seen there. Has start,
  /// linear and normal only.
  std::shared_ptr<const CalibrationSolution> before_leaving_out{};
  bool does_not_fit = false;  ///< more than a third of the images do not fit: none of these was left out
};

/// Fails as solve_calibration().
Result<CalibrationSolution> solve_whole(const CalibrationInput& input, const Context& context);

/// The same lens model, noise and images, from the pairs marked in `pairs` alone; starts at the whole solution.
Result<CalibrationSolution> solve_part(const CalibrationSolution& whole, const std::vector<bool>& pairs,
                                       const Context& context);

/// Sigma of a coordinate of corners and dots from the median residual, freedom of the poses counted; sets it in
/// `setup`.
void measure_noise(BundleSetup& setup, const Unknowns& unknowns);

/// How the images fit, by image and by placement; fills SolvedCalibration::images, placements and median_px.
void describe_images(const CalibrationInput& input, const CalibrationSolution& solution,
                     const std::vector<std::array<std::string, 2>>& reasons, SolvedCalibration& out);

/// Cameras, board, table, covariance and sigma of a solution.
Result<void> describe_solution(const CalibrationInput& input, CalibrationSolution& solution);

}  // namespace scanrig
