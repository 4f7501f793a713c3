#include "pipeline/evaluate/frame_height.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace scanrig {
namespace {

struct Sight {
  Eigen::Vector3d from, along;  ///< turntable frame
};

Sight sight(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Transform turntable_from_camera = camera.camera_from_turntable.inverse();
  return {turntable_from_camera.translation(), (turntable_from_camera.linear() * camera.ray(pixel)).normalized()};
}

/// The point nearest to both.
Eigen::Vector3d meeting(const Sight& a, const Sight& b) {
  const auto across = [](const Sight& s) -> Eigen::Matrix3d {
    return Eigen::Matrix3d::Identity() - s.along * s.along.transpose();
  };
  return (across(a) + across(b)).inverse() * (across(a) * a.from + across(b) * b.from);
}

}  // namespace

double frame_height(const Calibration& calibration, const Truth& truth) {
  constexpr int kAround = 16;
  double sum = 0.0;
  int seen = 0;
  for (const double share : {0.2, 0.4, 0.6}) {
    for (int i = 0; i < kAround; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / kAround, radius = share * truth.table_radius_mm;
      const Eigen::Vector3d point(radius * std::cos(turn), 0.0, radius * std::sin(turn));
      const Eigen::Vector2d left = truth.left.project(point), right = truth.right.project(point);
      if (!truth.left.projection.contains(left) || !truth.right.projection.contains(right)) continue;
      sum -= meeting(sight(calibration.left, left), sight(calibration.right, right)).y();
      ++seen;
    }
  }
  return seen > 0 ? sum / seen : 0.0;
}

Claim raised(Claim claim, double height) {
  const Eigen::Vector3d up(0.0, height, 0.0);
  for (auto& vertex : claim.model.mesh.vertices) vertex += up.cast<float>();
  if (claim.pose_uncertainty) claim.pose_uncertainty->centre += up;
  const auto raise = [&](Transform& pose) { pose.translation() += up - pose.linear() * up; };
  if (claim.pose1_from_pose2) raise(*claim.pose1_from_pose2);
  for (ClaimedPose& further : claim.further_poses) {
    raise(further.frame_from_pose);
    if (further.uncertainty) further.uncertainty->centre += up;
  }
  return claim;
}

}  // namespace scanrig
