#include "pipeline/registration/pose_uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "pipeline/registration/joint_uncertainty.h"

namespace scanrig {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::size_t kBentPoints = 3000;  // tell how a wrong calibration pulls: it bends surface smoothly

}  // namespace

Matrix6 motion_covariance(const Matrix6& information, std::span<const MotionScore> scores) {
  std::vector<JointScore> joint;
  joint.reserve(scores.size());
  for (const MotionScore& s : scores) joint.push_back({.of_link = s});
  return joint_covariance(information, joint);
}

Matrix6 axis_covariance(const Transform& pose1_from_pose2, const Eigen::Vector3d& centre, const AxisUncertainty& axis) {
  // A frame moved by the small turn f and shift d sees the motion as F T F^-1: off by f - R f, and at the centre by
  // f x c + d - R (f x c2 + d), with c2 the same point in pose 2.
  const Eigen::Matrix3d& turn = pose1_from_pose2.linear();
  const Eigen::Vector3d centre2 = pose1_from_pose2.inverse() * centre;
  Eigen::Matrix<double, 6, 4> by_axis;
  int column = 0;
  for (const int along : {0, 2}) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(along);
    by_axis.col(column) << axis.tilt_rad * (unit - turn * unit),
        axis.tilt_rad * (unit.cross(centre) - turn * unit.cross(centre2));
    by_axis.col(column + 1) << Eigen::Vector3d::Zero(), axis.shift_mm * (unit - turn * unit);
    column += 2;
  }
  return by_axis * by_axis.transpose();
}

Eigen::Matrix<double, 6, Eigen::Dynamic> pull_of_calibration(std::span<const MotionScore> scores,
                                                             const PairOfViews& views,
                                                             const Transform& pose1_from_pose2,
                                                             const CalibrationModes& modes) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> pull(6, 0);
  if (!modes) return pull;
  const std::size_t stride = std::max<std::size_t>(scores.size() / kBentPoints, 1);
  const Transform pose2_from_pose1 = pose1_from_pose2.inverse();
  for (std::size_t i = 0; i < scores.size(); i += stride) {
    const MotionScore& s = scores[i];
    const Eigen::Matrix3Xd apart =
        pose1_from_pose2.linear() * modes(views.pose2[static_cast<std::size_t>(s.view2)], pose2_from_pose1 * s.point) -
        modes(views.pose1[static_cast<std::size_t>(s.view1)], s.point);
    if (pull.cols() == 0) pull.setZero(6, apart.cols());
    const double weight = s.weight * static_cast<double>(stride);
    pull += weight * s.lever * (s.lever.tail<3>().transpose() * apart);  // the lever ends with the normal
  }
  return pull;
}

Eigen::MatrixXd covariance_of_pull(const Eigen::MatrixXd& information, const Eigen::MatrixXd& pull) {
  constexpr double kOpen = 1e-9;  // of the information in its own scale: less leaves a motion open
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * information * scale.asDiagonal());
  const Eigen::VectorXd inverse = solver.eigenvalues().unaryExpr([](double e) { return e > kOpen ? 1.0 / e : 0.0; });
  const Eigen::MatrixXd& directions = solver.eigenvectors();
  const Eigen::MatrixXd moved =
      scale.asDiagonal() *
      (directions * (inverse.asDiagonal() * (directions.transpose() * (scale.asDiagonal() * pull))));
  return moved * moved.transpose();
}

PrincipalSigmas principal_sigmas(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  return {solver.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt(), solver.eigenvectors().rowwise().reverse()};
}

}  // namespace scanrig
