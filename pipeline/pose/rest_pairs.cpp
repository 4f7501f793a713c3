#include "pipeline/pose/rest_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace scanrig {
namespace {

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Axes: the bisector of `a` and `b`, the direction from b to a, their normal. Where the two are (anti)parallel any
/// direction that completes the frame will do: the swivel is free then.
Eigen::Matrix3d bisector_frame(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d sum = a + b;
  const Eigen::Vector3d difference = a - b;
  Eigen::Matrix3d frame;
  if (sum.norm() > difference.norm()) {
    frame.col(0) = sum.normalized();
    frame.col(1) = difference - frame.col(0) * frame.col(0).dot(difference);
    if (frame.col(1).norm() < 1e-9) frame.col(1) = frame.col(0).unitOrthogonal();
    frame.col(1).normalize();
  } else {
    frame.col(1) = difference.normalized();
    frame.col(0) = sum - frame.col(1) * frame.col(1).dot(sum);
    if (frame.col(0).norm() < 1e-9) frame.col(0) = frame.col(1).unitOrthogonal();
    frame.col(0).normalize();
  }
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

std::vector<RestPair> pair_rests(const RestingSolid& pose1, const RestingSolid& pose2, const RestPairOptions& options) {
  const double size = 0.5 * (pose1.properties.size_mm + pose2.properties.size_mm);
  const double height_sigma = std::max(options.height_sigma_mm, options.height_sigma * size);
  std::vector<RestPair> pairs;
  for (const StableRest& one : pose1.rests) {
    for (const StableRest& two : pose2.rests) {
      const double turn = angle_between(one.normal, base_normal()) - angle_between(two.normal, base_normal());
      const Eigen::Vector3d misfit(to_degrees(turn) / options.angle_sigma_deg,
                                   (one.height_mm - pose2.height_mm) / height_sigma,
                                   (two.height_mm - pose1.height_mm) / height_sigma);
      pairs.push_back({one, two, misfit.squaredNorm()});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const RestPair& a, const RestPair& b) { return a.cost < b.cost; });
  if (pairs.size() > static_cast<std::size_t>(options.max_pairs)) pairs.resize(options.max_pairs);
  return pairs;
}

Transform transform_of(const RestPair& pair, const SolidProperties& pose1, const SolidProperties& pose2, double swivel,
                       const RestPairOptions& options) {
  const Eigen::Vector3d base = base_normal();
  const Eigen::Vector3d& contact1 = pair.of_pose1.normal;  // of pose 2's table, seen in pose 1
  const Eigen::Vector3d& contact2 = pair.of_pose2.normal;  // of pose 1's table, seen in pose 2
  // (n_T2, n_B) in pose 2 are (n_B, n_T1) in pose 1.
  const Eigen::Matrix3d turn = bisector_frame(base, contact1) * bisector_frame(contact2, base).transpose();
  Transform t = Transform::Identity();
  t.linear() = Eigen::AngleAxisd(swivel, contact1).toRotationMatrix() * turn;

  // Least squares over n_B.t = -D_T2, n_T1.t = D_T1 and the centres of mass, which are inaccurate in partial models.
  const Eigen::Vector3d between_centres = pose1.centre_of_mass - t.linear() * pose2.centre_of_mass;
  const Eigen::Matrix3d normal =
      base * base.transpose() + contact1 * contact1.transpose() + options.centre_weight * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d right =
      -pair.of_pose2.offset_mm * base + pair.of_pose1.offset_mm * contact1 + options.centre_weight * between_centres;
  t.translation() = normal.ldlt().solve(right);
  return t;
}

std::vector<Contact> contacts_for(const Transform& pose1_from_pose2, std::span<const RestPair> pairs,
                                  const SolidProperties& pose2, const RestPairOptions& options) {
  const Eigen::Matrix3d& turn = pose1_from_pose2.linear();
  const RestPair* best = nullptr;
  double nearest = to_radians(options.max_contact_deg);
  for (const RestPair& pair : pairs) {
    const double apart = std::max(angle_between(pair.of_pose1.normal, turn * base_normal()),
                                  angle_between(pair.of_pose2.normal, turn.transpose() * base_normal()));
    if (apart >= nearest) continue;
    nearest = apart;
    best = &pair;
  }
  if (!best) return {};
  const auto foot_on = [&](const Eigen::Vector3d& normal, double offset) {
    return Eigen::Vector3d(pose2.centre_of_mass + normal * (offset - normal.dot(pose2.centre_of_mass)));
  };
  return {{foot_on(best->of_pose2.normal, best->of_pose2.offset_mm), base_normal(), 0.0},
          {foot_on(base_normal(), 0.0), best->of_pose1.normal, best->of_pose1.offset_mm}};
}

std::vector<double> swivels_of(const RestPair& pair, const RestPairOptions& options) {
  const double from_upside_down = to_degrees(angle_between(pair.of_pose1.normal, -base_normal()));
  std::vector<double> swivels;
  if (from_upside_down < options.upside_down_deg || from_upside_down > options.turned_back_deg) {
    const double step_deg = 360.0 / options.full_circle_steps;
    for (int k = 0; k < options.full_circle_steps; ++k) swivels.push_back(to_radians(step_deg * k));
  } else {
    for (const double degrees : {0.0, -options.swivel_deg, options.swivel_deg}) swivels.push_back(to_radians(degrees));
  }
  return swivels;
}

RestPair same_rest_pair(const RestingSolid& pose1, const RestingSolid& pose2) {
  const auto base_rest = [](double height) { return StableRest{base_normal(), 0.0, height, 0.0}; };
  return {base_rest(pose2.height_mm), base_rest(pose1.height_mm), 0.0};
}

}  // namespace scanrig
