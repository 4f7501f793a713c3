#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/calibration/camera.h"
#include "sim/scene/optics.h"

namespace scanrig {

/// What a calibration makes of points of the working volume, against the cameras that took its images.
struct CalibrationError {
  double rms_um = 0.0, max_um = 0.0;  ///< scale and height over the table taken off
  double scale_ppm = 0.0;
};

/// Where the lines of sight of both pixels are nearest to each other.
inline Eigen::Vector3d nearest_to_both(const Calibration& calibration, const Eigen::Vector2d& left,
                                       const Eigen::Vector2d& right) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [camera, pixel] : {std::pair(&calibration.left, left), std::pair(&calibration.right, right)}) {
    const Transform table_from_camera = camera->camera_from_turntable.inverse();
    const Eigen::Vector3d along = (table_from_camera.linear() * camera->ray(pixel)).normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along * along.transpose();
    normal += across;
    sum += across * table_from_camera.translation();
  }
  return normal.ldlt().solve(sum);
}

/// Points of the working volume, turntable frame, mm.
inline std::vector<Eigen::Vector3d> volume_points() {
  std::vector<Eigen::Vector3d> points;
  for (const double height : {2.0, 24.0, 46.0, 68.0, 90.0, 112.0}) {
    for (const double radius : {0.0, 18.0, 37.0, 55.0}) {
      for (int step = 0; step < (radius > 0.0 ? 12 : 1); ++step) {
        const double angle = step * M_PI / 6.0;
        points.emplace_back(radius * std::cos(angle), height, radius * std::sin(angle));
      }
    }
  }
  return points;
}

/// What one calibration makes of the points that another one sees, rms; nothing taken off.
inline double difference_um(const Calibration& one, const Calibration& other) {
  const auto points = volume_points();
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points) {
    sum += (nearest_to_both(one, other.left.project(p), other.right.project(p)) - p).squaredNorm();
  }
  return 1e3 * std::sqrt(sum / static_cast<double>(points.size()));
}

inline CalibrationError calibration_error(const Calibration& calibration, const sim::RigGeometry& truth) {
  const auto points = volume_points();
  std::vector<Eigen::Vector3d> errors;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : points) {
    errors.push_back(nearest_to_both(calibration, truth.left.project(p), truth.right.project(p)) - p);
    Eigen::Matrix<double, 3, 2> row;
    row << p, Eigen::Vector3d::UnitY();
    normal += row.transpose() * row;
    sum += row.transpose() * errors.back();
  }
  const Eigen::Vector2d fit = normal.ldlt().solve(sum);
  CalibrationError error{.rms_um = 0.0, .max_um = 0.0, .scale_ppm = 1e6 * fit.x()};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double um = 1e3 * (errors[i] - fit.x() * points[i] - fit.y() * Eigen::Vector3d::UnitY()).norm();
    error.rms_um += um * um / static_cast<double>(points.size());
    error.max_um = std::max(error.max_um, um);
  }
  error.rms_um = std::sqrt(error.rms_um);
  return error;
}

}  // namespace scanrig
