#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/units.h"
#include "pipeline/evaluate/truth_file.h"
#include "tests/unit/pipeline/mesh/ball_mesh.h"

namespace scanrig::ball_truth {

using ball_mesh::ball;
using ball_mesh::kCentre;
using ball_mesh::kRadius;

/// A camera frame at `position` whose z axis goes through `target`, y down.
inline Transform looking(const Eigen::Vector3d& position, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - position).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rows;
  rows << x.transpose(), z.cross(x).transpose(), z.transpose();
  Transform transform = Transform::Identity();
  transform.linear() = rows;
  transform.translation() = -rows * position;
  return transform;
}

/// `distance` from the ball's centre, at `elevation_deg`, `aside_deg` off the +Z direction.
inline Eigen::Vector3d place(double elevation_deg, double aside_deg, double distance = 640.0) {
  const double e = to_radians(elevation_deg), a = to_radians(aside_deg);
  return kCentre + distance * Eigen::Vector3d(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a));
}

inline Camera camera_at(const Eigen::Vector3d& position) {
  Camera camera;
  camera.projection = {Projection::Kind::pinhole, 1280, 960, 4266.0, 4266.0, 639.5, 479.5};
  camera.camera_from_turntable = looking(position, kCentre);
  return camera;
}

/// A rig of the default's dimensions that looks at the ball's centre.
inline Truth rig_and_ball(const std::vector<double>& angles_deg) {
  Truth truth;
  truth.mesh = ball();
  truth.mesh.views.clear();
  truth.left = camera_at(place(22.0, -7.1));
  truth.right = camera_at(place(22.0, 7.1));
  truth.projector_from_turntable = looking(place(30.0, 0.0), kCentre);
  truth.table_radius_mm = 90.0;
  truth.poses = {{Transform::Identity(), angles_deg}};
  return truth;
}

}  // namespace scanrig::ball_truth
