#include "pipeline/registration/joint_uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <map>

namespace scanrig {
namespace {

using ViewOfPose = std::pair<std::size_t, int>;

void add_pull(const JointScore& score, Eigen::VectorXd& sum) {
  sum.segment<6>(6 * static_cast<Eigen::Index>(score.pose2)) += score.pull;
  sum.segment<6>(6 * static_cast<Eigen::Index>(score.pose1)) -= score.pull;
}

template <class Value>
Eigen::MatrixXd with_values(const Eigen::MatrixXd& matrix, const Value& value) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().unaryExpr(value).asDiagonal() * solver.eigenvectors().transpose();
}

/// Outer products of the sums by view, less those by pair of views; of all poses, the first one too.
Eigen::MatrixXd spread_of(std::span<const JointScore> scores, Eigen::Index size) {
  std::map<ViewOfPose, Eigen::VectorXd> by_view;
  std::map<std::pair<ViewOfPose, ViewOfPose>, Eigen::VectorXd> by_pair;
  for (const JointScore& score : scores) {
    const ViewOfPose first(score.pose1, score.view1), second(score.pose2, score.view2);
    for (const ViewOfPose& view : {first, second}) {
      add_pull(score, by_view.try_emplace(view, Eigen::VectorXd::Zero(size)).first->second);
    }
    add_pull(score, by_pair.try_emplace({first, second}, Eigen::VectorXd::Zero(size)).first->second);
  }
  std::map<std::size_t, double> views;
  for (const auto& [view, sum] : by_view) views[view.first] += 1.0;
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(size, size);
  for (const auto& [view, sum] : by_view) {
    const double count = views[view.first];
    if (count > 1.0) spread.noalias() += count / (count - 1.0) * sum * sum.transpose();
  }
  const double pairs = static_cast<double>(by_pair.size());
  for (const auto& [pair, sum] : by_pair) {
    if (pairs > 1.0) spread.noalias() -= pairs / (pairs - 1.0) * sum * sum.transpose();
  }
  return spread;
}

}  // namespace

Eigen::MatrixXd joint_covariance(const Eigen::MatrixXd& information, std::span<const JointScore> scores) {
  const Eigen::Index size = information.rows();
  // Rotations and translations have other units: each coordinate is scaled by its own information.
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd inverse = with_values(scaled, [](double e) { return 1.0 / std::max(e, 1e-9); });
  const Eigen::MatrixXd spread = spread_of(scores, size + 6).bottomRightCorner(size, size);
  const Eigen::MatrixXd scaled_spread = scale.asDiagonal() * spread * scale.asDiagonal();
  const Eigen::MatrixXd positive = with_values(scaled_spread, [](double e) { return std::max(e, 0.0); });
  return scale.asDiagonal() * (inverse + inverse * positive * inverse) * scale.asDiagonal();
}

}  // namespace scanrig
