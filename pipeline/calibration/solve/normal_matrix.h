#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/result.h"
#include "pipeline/calibration/solve/bundle.h"

namespace scanrig {

/// J'WJ of the bundle, factorised dense: its inverse is the covariance of all unknowns.
class NormalMatrix {
 public:
  /// Fails with `degenerate` ("singular"): the images and priors leave a combination of unknowns open.
  static Result<NormalMatrix> factorise(const Linearised& linear);
  /// For a dense, symmetric matrix.
  static Result<NormalMatrix> factorise(Eigen::MatrixXd matrix);

  /// L^-1 right, where L L' is the matrix: the columns' products are those of right' covariance right.
  [[nodiscard]] Eigen::MatrixXd half_solve(const Eigen::MatrixXd& right) const;
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;
  [[nodiscard]] int size() const { return static_cast<int>(scale_.size()); }

 private:
  Eigen::VectorXd scale_;  ///< of each unknown, so that the scaled matrix has ones on its diagonal
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace scanrig
