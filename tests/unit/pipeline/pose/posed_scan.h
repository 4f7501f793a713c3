#pragma once

#include "pipeline/pose/estimate_pose.h"
#include "tests/unit/pipeline/pose/solid_mesh.h"

/// Objects in two poses, as range images and closed partial solids.
namespace scanrig::testing {

inline const RigModel kPoseRig{.width = 288, .height = 216, .focal_px = 1000, .noise_mm = 0.01};

/// An object in two poses, scanned and closed.
struct PosedScan {
  std::vector<View> views1, views2;
  Mesh solid1, solid2;
  Transform pose1_from_pose2;

  [[nodiscard]] Result<PoseEstimate> estimate(const PoseOptions& options = {}, const Context& context = {}) const {
    return estimate_pose({solid1, views1}, {solid2, views2}, options, context);
  }
};

inline Mesh closed(const Solid& solid) { return mesh_of(solid, {-65, -3, -65}, {65, 100, 65}, 2.5); }

/// `pose2_from_pose1` without its height: the object is put down on the table. `lift_mm`: putty under it.
inline PosedScan scan(const Solid& solid, const Eigen::Matrix3d& turned, double lift_mm = 0.0) {
  PosedScan s;
  s.views1 = turn_around(solid, 8, kPoseRig, 1);
  s.solid1 = closed(solid);
  const double lowest = -reach_along(s.solid1.vertices, -turned.transpose() * Eigen::Vector3d::UnitY());
  const Eigen::Vector3d centre = turned * solid_properties(s.solid1)->centre_of_mass;
  Transform pose2_from_pose1 = Transform::Identity();
  pose2_from_pose1.linear() = turned;
  pose2_from_pose1.translation() = Eigen::Vector3d(4 - centre.x(), lift_mm - lowest, -3 - centre.z());
  const Solid second = moved(solid, pose2_from_pose1);
  s.views2 = turn_around(second, 8, kPoseRig, 2);
  s.solid2 = closed(second);
  s.pose1_from_pose2 = pose2_from_pose1.inverse();
  return s;
}

inline Eigen::Matrix3d turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(to_radians(degrees), axis.normalized()).toRotationMatrix();
}

}  // namespace scanrig::testing
