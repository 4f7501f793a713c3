#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/units.h"
#include "pipeline/evaluate/truth.h"

namespace scanrig::ball_truth {

constexpr double kRadius = 25.0;
inline const Eigen::Vector3d kCentre(0.0, 45.0, 0.0);

/// A ball of triangles of about 0.8 mm.
inline Mesh ball(double radius = kRadius, const Eigen::Vector3d& centre = kCentre, int rings = 100) {
  Mesh mesh;
  const int around = 2 * rings;
  const auto add = [&](double polar, double azimuth) {
    const Eigen::Vector3d direction(std::sin(polar) * std::sin(azimuth), std::cos(polar),
                                    std::sin(polar) * std::cos(azimuth));
    mesh.vertices.push_back((centre + radius * direction).cast<float>());
  };
  add(0.0, 0.0);
  for (int r = 1; r < rings; ++r) {
    for (int a = 0; a < around; ++a) add(std::numbers::pi * r / rings, 2.0 * std::numbers::pi * a / around);
  }
  add(std::numbers::pi, 0.0);
  const auto at = [&](int r, int a) { return static_cast<std::uint32_t>(1 + (r - 1) * around + a % around); };
  const auto south = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  for (int a = 0; a < around; ++a) {
    mesh.faces.push_back({0, at(1, a), at(1, a + 1)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.faces.push_back({at(r, a), at(r + 1, a), at(r + 1, a + 1)});
      mesh.faces.push_back({at(r, a), at(r + 1, a + 1), at(r, a + 1)});
    }
    mesh.faces.push_back({at(rings - 1, a), south, at(rings - 1, a + 1)});
  }
  mesh.views.assign(mesh.vertices.size(), 1);
  return mesh;
}

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
