#include "pipeline/calibration/watch/rig_effects.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numbers>

#include "core/units.h"

namespace scanrig {
namespace {

constexpr double kRadiusMm = 55.0;
constexpr double kMinHeightMm = 2.0, kMaxHeightMm = 112.0;
constexpr int kLensUnknowns = 9, kCameraUnknowns = 15;

void move(Camera& camera, const Eigen::Matrix<double, 6, 1>& change) {
  Transform& pose = camera.camera_from_turntable;
  pose.linear() = small_motion(change.head<3>(), Eigen::Vector3d::Zero()).linear() * pose.linear();
  pose.translation() += change.tail<3>();
}

/// The camera with one unknown of its lens changed: fx, fy / fx, cx, cy, k1 k2 p1 p2 k3.
Camera with_lens(const Camera& camera, int unknown, double change) {
  Camera other = camera;
  Projection& p = other.projection;
  switch (unknown) {
    case 0:
      p.fy *= 1.0 + change / p.fx;
      p.fx += change;
      break;
    case 1: p.fy += change * p.fx; break;
    case 2: p.cx += change; break;
    case 3: p.cy += change; break;
    default: other.distortion.at(static_cast<std::size_t>(unknown) - 4) += change;
  }
  return other;
}

Eigen::Matrix<double, 2, kCameraUnknowns> pixel_by_camera(const Camera& camera, const Eigen::Vector3d& point) {
  constexpr std::array<double, kLensUnknowns> kSteps{1.0, 1e-4, 1.0, 1.0, 1e-3, 1e-2, 1e-4, 1e-4, 1e-1};
  Eigen::Matrix<double, 2, kCameraUnknowns> by;
  for (int i = 0; i < kLensUnknowns; ++i) {
    const double step = kSteps[static_cast<std::size_t>(i)];
    by.col(i) = (with_lens(camera, i, step).project(point) - with_lens(camera, i, -step).project(point)) / (2.0 * step);
  }
  by.rightCols<6>() = pixel_by_pose(camera, point);
  return by;
}

/// Least-squares inverse: point by both pixels.
Eigen::Matrix<double, 3, 4> point_by_pixels(const Calibration& calibration, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 4, 3> by;
  by.topRows<2>() = pixel_by_point(calibration.left, point);
  by.bottomRows<2>() = pixel_by_point(calibration.right, point);
  return (by.transpose() * by).inverse() * by.transpose();
}

/// Motions of the volume: shift x, z; tilt about x, z; turn about y; scale; shift y.
Eigen::Matrix<double, 3, 7> modes_at(const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 7> modes;
  modes << 1.0, 0.0, 0.0, -p.y(), p.z(), p.x(), 0.0,  //
      0.0, 0.0, -p.z(), p.x(), 0.0, p.y(), 1.0,       //
      0.0, 1.0, p.y(), 0.0, -p.x(), p.z(), 0.0;
  return modes;
}

}  // namespace

Calibration moved(const Calibration& calibration, const PoseChange& change) {
  Calibration other = calibration;
  move(other.left, change.head<6>());
  move(other.right, change.tail<6>());
  return other;
}

Eigen::Matrix<double, 2, 3> pixel_by_point(const Camera& camera, const Eigen::Vector3d& point) {
  constexpr double kStepMm = 1e-2;
  Eigen::Matrix<double, 2, 3> by;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStepMm * Eigen::Vector3d::Unit(axis);
    by.col(axis) = (camera.project(point + step) - camera.project(point - step)) / (2.0 * kStepMm);
  }
  return by;
}

PixelByPose pixel_by_pose(const Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Matrix3d rotation = camera.camera_from_turntable.linear();
  const Eigen::Matrix<double, 2, 3> by_camera_point = pixel_by_point(camera, point) * rotation.transpose();
  PixelByPose by;
  by << -by_camera_point * cross_matrix(rotation * point), by_camera_point;
  return by;
}

Eigen::Matrix<double, 3, 2 * kCameraUnknowns> point_by_cameras(const Calibration& calibration,
                                                               const Eigen::Vector3d& point) {
  const auto by_pixels = point_by_pixels(calibration, point);
  Eigen::Matrix<double, 3, 2 * kCameraUnknowns> by;
  by << by_pixels.leftCols<2>() * pixel_by_camera(calibration.left, point),
      by_pixels.rightCols<2>() * pixel_by_camera(calibration.right, point);
  return by;
}

std::vector<Eigen::Vector3d> working_points(const Calibration& calibration) {
  constexpr int kLevels = 5, kSteps = 8;
  std::vector<Eigen::Vector3d> points;
  for (int level = 0; level < kLevels; ++level) {
    const double y = kMinHeightMm + (kMaxHeightMm - kMinHeightMm) * level / (kLevels - 1);
    for (const double radius : {0.0, 0.5 * kRadiusMm, kRadiusMm}) {
      for (int step = 0; step < (radius > 0.0 ? kSteps : 1); ++step) {
        const double angle = 2.0 * std::numbers::pi * step / kSteps;
        const Eigen::Vector3d point(radius * std::sin(angle), y, radius * std::cos(angle));
        const auto is_seen_by = [&](const Camera& camera) {
          return (camera.camera_from_turntable * point).z() > 1.0 && camera.projection.contains(camera.project(point));
        };
        if (is_seen_by(calibration.left) && is_seen_by(calibration.right)) points.push_back(point);
      }
    }
  }
  return points;
}

RigEffects rig_effects(const Calibration& calibration) {
  RigEffects effects;
  for (PoseMatrix* form : {&effects.image_px2[0], &effects.image_px2[1], &effects.volume_mm2}) form->setZero();
  const auto points = working_points(calibration);
  std::vector<Eigen::Matrix<double, 3, 12>> shifts;
  Eigen::Matrix<double, 1, 12> height = Eigen::Matrix<double, 1, 12>::Zero();
  const double share = 1.0 / static_cast<double>(points.size());
  for (const Eigen::Vector3d& point : points) {
    const auto by_pixels = point_by_pixels(calibration, point);
    Eigen::Matrix<double, 3, 12> shift;
    for (int c = 0; c < 2; ++c) {
      const PixelByPose by = pixel_by_pose(c == 0 ? calibration.left : calibration.right, point);
      effects.image_px2[c].block<6, 6>(6 * c, 6 * c) += share * by.transpose() * by;
      shift.middleCols<6>(6 * c) = by_pixels.middleCols<2>(2 * c) * by;
    }
    effects.mm_per_px += share * by_pixels.col(2).squaredNorm();
    height += share * shift.row(1);
    shifts.push_back(shift);
  }
  effects.mm_per_px = std::sqrt(effects.mm_per_px);
  for (auto& shift : shifts) {
    shift.row(1) -= height;
    effects.volume_mm2 += share * shift.transpose() * shift;
  }
  return effects;
}

AxisSigma axis_sigma(const Calibration& calibration, const CalibrationQuality& quality) {
  Eigen::Matrix<double, 7, 7> normal = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 7, 2 * kCameraUnknowns> sum = Eigen::Matrix<double, 7, 2 * kCameraUnknowns>::Zero();
  for (const Eigen::Vector3d& point : working_points(calibration)) {
    const auto modes = modes_at(point);
    normal += modes.transpose() * modes;
    sum += modes.transpose() * point_by_cameras(calibration, point);
  }
  const Eigen::MatrixXd fit = normal.ldlt().solve(sum);
  const Eigen::MatrixXd covariance = fit * quality.cameras * fit.transpose();
  const auto mean_sigma = [&](int a, int b) { return std::sqrt(0.5 * (covariance(a, a) + covariance(b, b))); };
  return {to_degrees(mean_sigma(2, 3)), mean_sigma(0, 1)};
}

}  // namespace scanrig
