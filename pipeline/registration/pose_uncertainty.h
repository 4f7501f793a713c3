#pragma once

#include <Eigen/Core>
#include <span>

namespace scanrig {

/// What one correspondence says of a motion.
struct MotionScore {
  Eigen::Matrix<double, 6, 1> pull =
      Eigen::Matrix<double, 6, 1>::Zero();  ///< its part of the right-hand side, 0 in sum
  int view1 = 0, view2 = 0;                 ///< of pose 1 and pose 2
};

/// Covariance of a motion found by weighted least squares, `information` its normal matrix, from how much the views
/// disagree: errors within one view are alike (calibration, angle, matching), those of different views are not. Scores
/// are summed by view of pose 1 and by view of pose 2, and pairs that both sums hold are taken out once [Cameron,
/// Gelbach and Miller 2011, two-way clustering]. What would be left with independent errors is added; with one view in
/// a pose, that alone. Directions that the surfaces leave open have a very large variance.
Eigen::Matrix<double, 6, 6> motion_covariance(const Eigen::Matrix<double, 6, 6>& information,
                                              std::span<const MotionScore> scores);

/// Principal standard deviations of three coordinates, weakest first, and their directions in columns.
struct PrincipalSigmas {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();
};
PrincipalSigmas principal_sigmas(const Eigen::Matrix3d& covariance);

}  // namespace scanrig
