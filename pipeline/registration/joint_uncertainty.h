#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "pipeline/registration/pose_uncertainty.h"

/// Uncertainty of several motions found together. Internal to this folder.
namespace scanrig {

/// What one correspondence says of the motion of pose `pose2` against pose `pose1`.
struct JointScore {
  MotionScore of_link;  ///< its lever is of the motion of `pose2`; of `pose1` it is the opposite
  std::size_t pose1 = 0, pose2 = 1;
};

/// Of the motions of all poses but the first, six coordinates each; `information` is their normal matrix. They are
/// found again without each view, each pair of views and each place. Sources and what is taken for independent:
/// motion_covariance(), which is this of two poses.
Eigen::MatrixXd joint_covariance(const Eigen::MatrixXd& information, std::span<const JointScore> scores);

}  // namespace scanrig
