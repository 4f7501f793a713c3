#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "core/parallel.h"
#include "core/transform.h"
#include "core/units.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/range/range_image.h"

/// Solids given by their signed distance (mm, negative inside) and their views from a turntable camera.
namespace scanrig::testing {

using Solid = std::function<double(const Eigen::Vector3d&)>;

inline Solid ball(const Eigen::Vector3d& centre, double radius) {
  return [=](const Eigen::Vector3d& p) { return (p - centre).norm() - radius; };
}
inline Solid block(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = (p - 0.5 * (low + high)).cwiseAbs() - 0.5 * (high - low);
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  };
}
inline Solid upright_cylinder(const Eigen::Vector3d& foot, double radius, double height) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = p - foot;
    const Eigen::Vector2d d(std::hypot(q.x(), q.z()) - radius, std::abs(q.y() - 0.5 * height) - 0.5 * height);
    return d.cwiseMax(0.0).norm() + std::min(d.maxCoeff(), 0.0);
  };
}
inline Solid together(const std::vector<Solid>& parts) {
  return [=](const Eigen::Vector3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Solid& part : parts) nearest = std::min(nearest, part(p));
    return nearest;
  };
}
/// `solid` carried by `target_from_solid`.
inline Solid moved(const Solid& solid, const Transform& target_from_solid) {
  const Transform back = target_from_solid.inverse();
  return [=](const Eigen::Vector3d& p) { return solid(back * p); };
}

inline Eigen::Vector3d outward_normal(const Solid& solid, const Eigen::Vector3d& p) {
  constexpr double kStep = 1e-4;
  Eigen::Vector3d g;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d e = kStep * Eigen::Vector3d::Unit(axis);
    g[axis] = solid(p + e) - solid(p - e);
  }
  return g.normalized();
}

struct RigModel {
  int width = 448, height = 336;
  double focal_px = 1600.0;  ///< 0.4 mm per pixel on the object
  double distance_mm = 640.0, elevation_deg = 22.0, aim_height_mm = 40.0;
  double noise_mm = 0.0;
  double sigma_mm = 0.01;  ///< claimed by the range image
};

inline Transform camera_from_turntable(const RigModel& rig) {
  const double e = to_radians(rig.elevation_deg);
  const Eigen::Vector3d forward(0, -std::sin(e), -std::cos(e));
  const Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Transform t = Transform::Identity();
  t.linear() << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  t.translation() = -t.linear() * (Eigen::Vector3d(0, rig.aim_height_mm, 0) - rig.distance_mm * forward);
  return t;
}

/// The view of `solid` (pose frame) from `camera_from_pose`, by sphere tracing.
inline RangeImage see(const Solid& solid, const Transform& camera_from_pose, const RigModel& rig, unsigned seed) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  RangeImage image;
  image.projection = {
      Projection::Kind::pinhole, rig.width, rig.height, rig.focal_px, rig.focal_px, 0.5 * (rig.width - 1),
      0.5 * (rig.height - 1)};
  image.camera_from_pose = camera_from_pose;
  image.depth = cv::Mat1f(rig.height, rig.width, kNaN);
  image.sigma = cv::Mat1f(rig.height, rig.width, kNaN);
  image.normal = cv::Mat3f(rig.height, rig.width, cv::Vec3f(kNaN, kNaN, kNaN));
  image.background = cv::Mat1b(rig.height, rig.width, static_cast<unsigned char>(255));
  const Transform pose_from_camera = camera_from_pose.inverse();
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int v = 0; v < rig.height; ++v) {
    for (int u = 0; u < rig.width; ++u) {
      const Eigen::Vector3d ray = image.projection.unproject(u, v, 1.0);
      const Eigen::Vector3d direction = pose_from_camera.linear() * ray;
      double z = rig.distance_mm - 150.0;
      double d = 1.0;
      for (int step = 0; step < 200 && d > 1e-6 && z < rig.distance_mm + 150.0; ++step) {
        d = solid(pose_from_camera.translation() + z * direction);
        z += d / ray.norm();
      }
      if (d > 1e-6) continue;
      const Eigen::Vector3d normal =
          camera_from_pose.linear() * outward_normal(solid, pose_from_camera.translation() + z * direction);
      if (normal.dot(ray.normalized()) > -0.15) continue;  // too grazing to be measured; not background either
      image.depth(v, u) = static_cast<float>(z + rig.noise_mm * noise(random));
      image.sigma(v, u) = static_cast<float>(std::max(rig.sigma_mm, rig.noise_mm));
      image.normal(v, u) =
          cv::Vec3f(static_cast<float>(normal.x()), static_cast<float>(normal.y()), static_cast<float>(normal.z()));
    }
  }
  for (int v = 0; v < rig.height; ++v) {
    for (int u = 0; u < rig.width; ++u) {
      if (std::isnan(image.depth(v, u))) continue;
      for (int k = -2; k <= 2; ++k) {
        for (int l = -2; l <= 2; ++l) {
          if (v + k >= 0 && v + k < rig.height && u + l >= 0 && u + l < rig.width) image.background(v + k, u + l) = 0;
        }
      }
    }
  }
  return image;
}

/// `count` views around the full turn of `solid` (turntable frame).
inline std::vector<View> turn_around(const Solid& solid, int count, const RigModel& rig, unsigned seed = 1) {
  std::vector<View> views(count);
  parallel_for(views.size(), [&](std::size_t k) {
    views[k].index = static_cast<int>(k);
    views[k].angle_rad = 2.0 * std::numbers::pi * static_cast<double>(k) / count;
    views[k].range =
        see(solid, camera_from_turntable(rig) * rot_y(views[k].angle_rad), rig, seed * 1000 + static_cast<unsigned>(k));
  });
  return views;
}

/// A block with a tower, a ball and a foot: no symmetry, flat sides to rest on, lowest point at y = 0.
inline Solid workpiece() {
  return together({block({-30, 0, -20}, {30, 22, 20}), block({-30, 10, -20}, {-8, 62, 6}), ball({17, 24, 4}, 14),
                   block({5, 0, 15}, {30, 12, 32})});
}

/// `t` disturbed by `angle_deg` about some axis through the middle of a workpiece and by `shift_mm`.
inline Transform off_by(const Transform& t, double angle_deg, double shift_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
  const Eigen::Translation3d middle(0, 25, 0);
  const Eigen::Vector3d turn = to_radians(angle_deg) * direction();
  return middle * small_motion(turn, shift_mm * direction()) * middle.inverse() * t;
}

}  // namespace scanrig::testing
