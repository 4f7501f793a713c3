#pragma once

#include <array>

#include "pipeline/calibration/watch/rig_effects.h"

namespace scanrig {

/// What a rig does by itself between a calibration and a scan, one sigma.
struct RigDrift {
  double rows_px = 0.2;          ///< turn of a camera about its x axis, in pixels of its image
  double columns_px = 0.1;       ///< the same about its y axis
  double roll_rad = 5e-5;        ///< about its line of sight
  double camera_mm = 0.01;       ///< motion of a camera, each direction
  double table_mm = 0.05;        ///< motion of the table and its axis against both cameras, each direction
  double table_tilt_deg = 0.02;  ///< tilt of the axis, about x and z

  /// The same rig, left alone.
  [[nodiscard]] RigDrift scaled(double factor) const;
};

using TableChange = Eigen::Matrix<double, 5, 1>;  ///< shift x y z (mm), tilt about x and z (rad), turntable frame

/// Covariances of the changes of both poses, by cause.
struct RigPriors {
  std::array<PoseMatrix, 2> camera;            ///< each camera's own motion
  Eigen::Matrix<double, 12, 5> pose_by_table;  ///< what a motion of the table is, seen from both cameras
  TableChange table_variance;
  PoseMatrix calibration;  ///< of the calibration, lenses held; without height, azimuth and scale, which dots share

  [[nodiscard]] PoseMatrix table() const {
    return pose_by_table * table_variance.asDiagonal() * pose_by_table.transpose();
  }
  [[nodiscard]] PoseMatrix drift() const { return camera[0] + camera[1] + table(); }
  [[nodiscard]] PoseMatrix total() const { return drift() + calibration; }
};

/// `quality`: that of the calibration; drift without it is the caller's to judge.
RigPriors rig_priors(const Calibration& calibration, const CalibrationQuality& quality, const RigDrift& drift);

}  // namespace scanrig
