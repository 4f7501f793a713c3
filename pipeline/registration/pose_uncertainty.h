#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "core/transform.h"

namespace scanrig {

/// What one correspondence says of a motion.
struct MotionScore {
  Eigen::Matrix<double, 6, 1> lever = Eigen::Matrix<double, 6, 1>::Zero();  ///< derivative of its residual
  double weight = 0.0;                              ///< its part of the normal matrix is weight * lever * lever^T
  double residual = 0.0;                            ///< weight * residual * lever is 0 in sum
  int view1 = 0, view2 = 0;                         ///< of pose 1 and pose 2
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< of the surface, in the motion's frame
};

/// Covariance of a motion found by weighted least squares, `information` its normal matrix, from how much views and
/// places of the surface disagree. Errors within one view are alike (calibration, angle), and so are those at one place
/// in all views that show it (an edge, a narrow cut: what matching does there). The motion is found again without each
/// view of pose 1, without each of pose 2, without each pair, whose scatter both others hold and which is taken out
/// once, and without each place [Cameron, Gelbach and Miller 2011, clustering by several ways; MacKinnon, Nielsen and
/// Webb 2023, the jackknife by clusters]: where few views or places hold a direction, their residuals are small because
/// the motion has followed them. What would be left with independent errors is added; with one view in a pose, that and
/// the places alone. Two standard deviations hold 95 % although so few views tell them: the scatter of views is widened
/// by Student's factor, 1.21 for 8 views [GUM, annex G]. Directions that the surfaces leave open have a very large
/// variance.
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

/// Shifts (pose frame, mm; one per column) of a point that the view at `camera_from_pose` measured, by independent
/// errors of the calibration of one standard deviation each. Empty: the calibration does not say how sure it is.
using CalibrationModes =
    std::function<Eigen::Matrix3Xd(const Transform& camera_from_pose, const Eigen::Vector3d& point)>;

/// Where the views of both poses stand, camera_from_pose.
struct PairOfViews {
  std::vector<Transform> pose1, pose2;
};

/// What wrong calibrations, one column each, add to the right side of the normal equations of a motion: all views see
/// the surface bent alike, each from its side, so it is nothing that they disagree about. `scores`: of the motion in
/// pose 1's frame.
Eigen::Matrix<double, 6, Eigen::Dynamic> pull_of_calibration(std::span<const MotionScore> scores,
                                                             const PairOfViews& views,
                                                             const Transform& pose1_from_pose2,
                                                             const CalibrationModes& modes);

/// Covariance of motions that are pulled so, `information` their normal matrix; not along what that leaves open.
Eigen::MatrixXd covariance_of_pull(const Eigen::MatrixXd& information, const Eigen::MatrixXd& pull);

/// Principal standard deviations of three coordinates, weakest first, and their directions in columns.
struct PrincipalSigmas {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();
};
PrincipalSigmas principal_sigmas(const Eigen::Matrix3d& covariance);

}  // namespace scanrig
