#pragma once

#include <Eigen/Core>
#include <span>

#include "core/transform.h"

namespace scanrig {

/// What one correspondence says of a motion.
struct MotionScore {
  Eigen::Matrix<double, 6, 1> lever = Eigen::Matrix<double, 6, 1>::Zero();  ///< derivative of its residual
  double weight = 0.0;       ///< its part of the normal matrix is weight * lever * lever^T
  double residual = 0.0;     ///< weight * residual * lever is 0 in sum
  int view1 = 0, view2 = 0;  ///< of pose 1 and pose 2
};

/// Covariance of a motion found by weighted least squares, `information` its normal matrix, from how much the views
/// disagree: errors within one view are alike (calibration, angle, matching), those of different views are not. The
/// motion is found again without each view of pose 1, without each of pose 2, and without each pair, whose scatter both
/// others hold and which is taken out once [Cameron, Gelbach and Miller 2011, two-way clustering; MacKinnon, Nielsen
/// and Webb 2023, the jackknife by clusters]: where few views hold a direction, their residuals are small because the
/// motion has followed them. What would be left with independent errors is added; with one view in a pose, that alone.
/// Directions that the surfaces leave open have a very large variance.
Eigen::Matrix<double, 6, 6> motion_covariance(const Eigen::Matrix<double, 6, 6>& information,
                                              std::span<const MotionScore> scores);

/// Of the turntable's axis, to which both poses' frames are tied: standard deviations.
struct AxisUncertainty {
  double tilt_rad = 0.0;  ///< about x and about z
  double shift_mm = 0.0;  ///< along x and along z
};

/// Covariance that a wrong axis adds to the motion from pose 2 to pose 1 (rotation vector, translation at `centre` in
/// pose 1): both poses are seen in the same wrong frame, which a turn of the object does not cancel. It is nothing that
/// views could disagree about.
Eigen::Matrix<double, 6, 6> axis_covariance(const Transform& pose1_from_pose2, const Eigen::Vector3d& centre,
                                            const AxisUncertainty& axis);

/// Principal standard deviations of three coordinates, weakest first, and their directions in columns.
struct PrincipalSigmas {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();
};
PrincipalSigmas principal_sigmas(const Eigen::Matrix3d& covariance);

}  // namespace scanrig
