#include "pipeline/registration/pose_uncertainty.h"

#include <Eigen/Eigenvalues>
#include <vector>

#include "pipeline/registration/joint_uncertainty.h"

namespace scanrig {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

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

PrincipalSigmas principal_sigmas(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  return {solver.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt(), solver.eigenvectors().rowwise().reverse()};
}

}  // namespace scanrig
