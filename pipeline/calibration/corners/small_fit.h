#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace scanrig {

/// Up to 16 unknowns; the first two are a place in pixels.
using FitVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 16, 1>;
using FitMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 16, 16>;

/// Sums of a least-squares problem at one place: of squared residuals, J'J and J'r.
struct FitSums {
  explicit FitSums(Eigen::Index unknowns)
      : normal(FitMatrix::Zero(unknowns, unknowns)), slope(FitVector::Zero(unknowns)) {}

  void add(double residual, const FitVector& derivatives) {
    cost += residual * residual;
    normal.selfadjointView<Eigen::Lower>().rankUpdate(derivatives);
    slope += residual * derivatives;
  }

  double cost = 0.0;
  FitMatrix normal;  // lower half
  FitVector slope;
};

/// Levenberg-Marquardt: `sums_at(unknowns)` returns the FitSums there. Changes `unknowns`; returns whether the place
/// came to rest.
template <class SumsAt>
bool minimise(FitVector& unknowns, const SumsAt& sums_at) {
  constexpr int kMaxSteps = 40;
  constexpr double kAtRest = 1e-4;  // pixels
  double damping = 1e-3;
  FitSums now = sums_at(unknowns);
  for (int i = 0; i < kMaxSteps; ++i) {
    FitMatrix damped = now.normal;
    damped.diagonal().array() *= 1.0 + damping;
    damped.diagonal().array() += 1e-9;
    const FitVector step = -damped.selfadjointView<Eigen::Lower>().ldlt().solve(now.slope);
    if (!step.allFinite()) return false;
    const FitVector next = unknowns + step;
    const FitSums there = sums_at(next);
    const bool is_at_rest = step.head<2>().norm() < kAtRest;
    if (there.cost <= now.cost) {
      const bool is_flat = now.cost - there.cost < 1e-7 * now.cost;
      unknowns = next;
      now = there;
      damping = damping > 1e-8 ? damping / 8.0 : damping;
      if (is_at_rest && (is_flat || damping < 1e-4)) return true;
    } else {
      if (is_at_rest && damping > 1e3) return true;
      damping *= 8.0;
      if (damping > 1e12) return false;
    }
  }
  return false;
}

}  // namespace scanrig
