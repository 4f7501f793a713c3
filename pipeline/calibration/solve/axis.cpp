#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/statistics.h"
#include "pipeline/calibration/solve/start.h"

namespace scanrig {
namespace {

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

double median(const std::vector<double>& values) { return quantile(values, 0.5); }

Eigen::Vector3d median_of(const std::vector<Eigen::Vector3d>& values) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> part;
    for (const auto& value : values) part.push_back(value[axis]);
    middle[axis] = median(part);
  }
  return middle;
}

Eigen::Matrix3d mean_rotation(const std::vector<Transform>& motions) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Transform& motion : motions) sum += motion.linear();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) sign.z() = -1.0;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Vector3d axis_point(const std::vector<TableTurn>& turns, const Eigen::Vector3d& direction,
                           const Eigen::Vector3d& near) {
  Eigen::Matrix3d normal = direction * direction.transpose() * static_cast<double>(turns.size());
  Eigen::Vector3d right = direction * direction.dot(near) * static_cast<double>(turns.size());
  for (const TableTurn& turn : turns) {
    const Eigen::Matrix3d a = Eigen::Matrix3d::Identity() - turn.motion.linear();
    normal += a.transpose() * a;
    right += a.transpose() * turn.motion.translation();
  }
  return normal.ldlt().solve(right);
}

}  // namespace

Transform middle_motion(const std::vector<Transform>& motions) {
  std::vector<Transform> kept = motions;
  Transform middle = Transform::Identity();
  for (int round = 0; round < 3; ++round) {
    std::vector<Eigen::Vector3d> shifts;
    for (const Transform& motion : kept) shifts.push_back(motion.translation());
    middle.linear() = mean_rotation(kept);
    middle.translation() = median_of(shifts);
    std::vector<double> away;
    for (const Transform& motion : motions) {
      away.push_back(rotation_angle(middle.linear().transpose() * motion.linear()));
    }
    const double limit = 3.0 * median(away);
    kept.clear();
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (away[i] <= limit) kept.push_back(motions[i]);
    }
    if (kept.size() == motions.size()) break;
  }
  return middle;
}

std::optional<TurnAxis> find_axis(const std::vector<TableTurn>& turns, const Eigen::Vector3d& near) {
  if (turns.empty()) return std::nullopt;
  std::vector<Eigen::Vector3d> per_radian;
  for (const TableTurn& turn : turns) per_radian.push_back(rotation_vector(turn.motion.linear()) / turn.angle_rad);
  Eigen::Vector3d mean = median_of(per_radian);
  std::vector<TableTurn> kept;
  for (int round = 0; round < 2; ++round) {
    std::vector<double> away;
    for (const auto& vector : per_radian) away.push_back((vector - mean).norm());
    const double limit = std::max(1e-6, 3.0 * median(away));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0.0;
    kept.clear();
    for (std::size_t i = 0; i < turns.size(); ++i) {
      if (away[i] > limit) continue;
      kept.push_back(turns[i]);
      sum += per_radian[i] * turns[i].angle_rad * turns[i].angle_rad;
      weight += turns[i].angle_rad * turns[i].angle_rad;
    }
    mean = sum / weight;
  }
  TurnAxis axis;
  axis.gear = mean.norm();
  if (!(axis.gear > 0.5 && axis.gear < 2.0)) return std::nullopt;
  axis.direction = mean / axis.gear;
  axis.point = axis_point(kept, axis.direction, near);
  return axis;
}

}  // namespace scanrig
