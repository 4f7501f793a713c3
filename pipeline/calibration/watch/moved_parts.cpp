#include "pipeline/calibration/watch/moved_parts.h"

#include <Eigen/Dense>
#include <cmath>

namespace scanrig {
namespace {

constexpr int kParts = 3;        // left camera, right camera, table
constexpr double kStill = 0.03;  // drift of a part that has not moved, as a share of its drift

/// Priors of a hypothesis: bit i of `parts`: part i moved.
RigPriors assume(const RigPriors& priors, int parts) {
  RigPriors assumed = priors;
  const auto factor = [&](int part) { return (parts >> part & 1) != 0 ? 1.0 : kStill * kStill; };
  assumed.camera[0] *= factor(0);
  assumed.camera[1] *= factor(1);
  assumed.table_variance *= factor(2);
  return assumed;
}

/// Twice the log likelihood of the measurements under the prior, but for a constant.
double likelihood(const RigFit& fit, const PoseMatrix& prior) {
  const PoseMatrix root = prior.llt().matrixL();
  const PoseMatrix inner = PoseMatrix::Identity() + root.transpose() * fit.normal * root;
  const Eigen::LLT<PoseMatrix> solver(inner);
  const PoseChange right = root.transpose() * fit.right;
  const PoseMatrix factor = solver.matrixL();
  return right.dot(solver.solve(right)) - 2.0 * factor.diagonal().array().log().sum();
}

}  // namespace

MovedParts find_moved_parts(const RigFit& fit, const RigPriors& priors) {
  RigPriors best = assume(priors, 0);
  double highest = likelihood(fit, best.drift());
  for (int parts = 1; parts < 1 << kParts; ++parts) {
    const RigPriors assumed = assume(priors, parts);
    const double found = likelihood(fit, assumed.drift());
    if (found <= highest) continue;
    highest = found;
    best = assumed;
  }
  const PoseMatrix information = best.drift().inverse();
  // Everything below is linear in fit.right, whose covariance is the noise's and the calibration's.
  const PoseMatrix by_right = information * (fit.normal + information).inverse();
  const PoseMatrix spread = fit.normal + fit.normal * best.calibration * fit.normal;
  const auto part = [&](const PoseMatrix& own) {
    const PoseMatrix share = own * by_right;
    return PartMotion{share * fit.right, share * spread * share.transpose()};
  };
  MovedParts parts;
  for (int c = 0; c < 2; ++c) parts.camera[c] = part(best.camera[c]);
  parts.table = part(best.table());
  parts.pair = part(best.camera[0] + best.camera[1]);
  parts.table_change = best.table_variance.asDiagonal() * best.pose_by_table.transpose() * by_right * fit.right;
  return parts;
}

}  // namespace scanrig
