#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/calibration/solve/unknowns.h"

namespace scanrig {

/// Adjusts the unknowns: least squares over all sightings and priors, with Cauchy's loss at 3 sigma. One thread; same
/// input, same bits. Returns the steps taken. `tolerance`: relative change of chi-square at which it ends. Fails with
/// `degenerate` (no convergence), `stopped`.
Result<int> adjust(const BundleSetup& setup, Unknowns& unknowns, double tolerance, const Context& context);

/// Columns of one group of unknowns; `count` 0: not solved for.
struct Columns {
  int first = 0;
  int count = 0;
};

/// The weighted least-squares problem at the solution: what is around it, linear.
struct Linearised {
  // Rows as compressed sparse rows; the first two of each sighting in the setup's order, then the priors.
  std::vector<int> row_start, column;
  std::vector<double> value;
  std::vector<double> residual;
  int columns = 0;
  std::array<Columns, 2> lens, pose, field;
  std::vector<Columns> placements;
  Columns shape;
};
Result<Linearised> linearise(const BundleSetup& setup, Unknowns& unknowns);

/// Pixel minus model of every sighting.
std::vector<Eigen::Vector2d> misses(const BundleSetup& setup, const Unknowns& unknowns);

/// Chi-square of all rows, each in its sigma, with the loss.
double robust_chi2(const BundleSetup& setup, Unknowns& unknowns);

}  // namespace scanrig
