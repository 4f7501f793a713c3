#include "pipeline/calibration/solve/normal_matrix.h"

namespace scanrig {

/// Smallest squared pivot of the scaled matrix; rounding leaves 1e-14 of a singular one.
constexpr double kMinPivot = 1e-12;

Result<NormalMatrix> NormalMatrix::factorise(const Linearised& linear) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(linear.columns, linear.columns);
  for (std::size_t row = 0; row + 1 < linear.row_start.size(); ++row) {
    const int end = linear.row_start[row + 1];
    for (int a = linear.row_start[row]; a < end; ++a) {
      const double value = linear.value[static_cast<std::size_t>(a)];
      if (value == 0.0) continue;
      double* into = sum.col(linear.column[static_cast<std::size_t>(a)]).data();
      for (int b = linear.row_start[row]; b < end; ++b) {
        into[linear.column[static_cast<std::size_t>(b)]] += value * linear.value[static_cast<std::size_t>(b)];
      }
    }
  }
  return factorise(std::move(sum));
}

Result<NormalMatrix> NormalMatrix::factorise(Eigen::MatrixXd matrix) {
  const auto singular = [] {
    return fail(ErrorCode::degenerate,
                "calibration: singular: the images leave a part of it open; take boards in more places");
  };
  if (matrix.size() == 0 || !matrix.allFinite() || !(matrix.diagonal().minCoeff() > 0.0)) return singular();
  NormalMatrix made;
  made.scale_ = matrix.diagonal().cwiseSqrt().cwiseInverse();
  matrix = made.scale_.asDiagonal() * matrix * made.scale_.asDiagonal();
  made.factor_.compute(matrix);
  if (made.factor_.info() != Eigen::Success) return singular();
  const Eigen::VectorXd pivots = made.factor_.matrixLLT().diagonal();
  if (!(pivots.minCoeff() * pivots.minCoeff() > kMinPivot)) return singular();
  return made;
}

Eigen::MatrixXd NormalMatrix::half_solve(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd out = scale_.asDiagonal() * right;
  factor_.matrixL().solveInPlace(out);
  return out;
}

Eigen::MatrixXd NormalMatrix::solve(const Eigen::MatrixXd& right) const {
  return scale_.asDiagonal() * factor_.solve(scale_.asDiagonal() * right);
}

}  // namespace scanrig
