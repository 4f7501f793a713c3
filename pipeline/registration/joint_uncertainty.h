#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

/// Uncertainty of several motions found together. Internal to this folder.
namespace scanrig {

/// What one correspondence says of the motion of pose `pose2` against pose `pose1`.
struct JointScore {
  Eigen::Matrix<double, 6, 1> pull = Eigen::Matrix<double, 6, 1>::Zero();  ///< on `pose2`; on `pose1` the opposite
  std::size_t pose1 = 0, pose2 = 0;
  int view1 = 0, view2 = 0;  ///< of these poses
};

/// Of the motions of all poses but the first, six coordinates each; `information` is their normal matrix. Scores are
/// summed by the views that they share; pairs of views that both sums hold are taken out once. Sources and what is
/// taken for independent: motion_covariance(), which is this of two poses.
Eigen::MatrixXd joint_covariance(const Eigen::MatrixXd& information, std::span<const JointScore> scores);

}  // namespace scanrig
