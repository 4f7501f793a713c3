#include "pipeline/registration/pose_uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>
#include <utility>

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Sum of the outer products of the scores' sums by `key`; 0 with fewer than two groups.
template <class Key>
Matrix6 spread_by(std::span<const MotionScore> scores, const Key& key) {
  std::map<std::pair<int, int>, Vector6> sums;
  for (const MotionScore& score : scores) {
    sums.try_emplace(key(score), Vector6::Zero()).first->second += score.pull;
  }
  Matrix6 spread = Matrix6::Zero();
  if (sums.size() < 2) return spread;
  for (const auto& [group, sum] : sums) spread.noalias() += sum * sum.transpose();
  return spread * (static_cast<double>(sums.size()) / static_cast<double>(sums.size() - 1));
}

/// The symmetric matrix with every eigenvalue replaced by `value` of it.
template <int N, class Value>
Eigen::Matrix<double, N, N> with_eigenvalues(const Eigen::Matrix<double, N, N>& matrix, const Value& value) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().unaryExpr(value).asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace

Matrix6 motion_covariance(const Matrix6& information, std::span<const MotionScore> scores) {
  // Rotations and translations have other units: each coordinate is scaled by its own information.
  const Vector6 scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Matrix6 scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Matrix6 inverse = with_eigenvalues<6>(scaled, [](double e) { return 1.0 / std::max(e, 1e-9); });
  const Matrix6 spread = spread_by(scores, [](const MotionScore& s) { return std::pair(s.view1, -1); }) +
                         spread_by(scores, [](const MotionScore& s) { return std::pair(-1, s.view2); }) -
                         spread_by(scores, [](const MotionScore& s) { return std::pair(s.view1, s.view2); });
  const Matrix6 scaled_spread = scale.asDiagonal() * spread * scale.asDiagonal();
  const Matrix6 positive = with_eigenvalues<6>(scaled_spread, [](double e) { return std::max(e, 0.0); });
  const Matrix6 covariance = inverse + inverse * positive * inverse;
  return scale.asDiagonal() * covariance * scale.asDiagonal();
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
