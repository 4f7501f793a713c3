#pragma once

#include <array>
#include <vector>

#include "pipeline/calibration/observations.h"
#include "pipeline/calibration/watch/rig_effects.h"

namespace scanrig {

/// Row offset at one place, see pipeline/range/row_offsets.h.
struct RowSighting {
  Eigen::Vector3d point;  ///< turntable frame as the cameras see it, not turned with the table; mm
  double offset_px = 0.0;
  double sigma_px = 0.0;
};

/// What one view of a scan shows of the rig.
struct WatchView {
  double angle_rad = 0.0;                           ///< of the table, as reported
  std::array<std::vector<DotObservation>, 2> dots;  ///< left, right; id: index into CalibrationQuality::rim_dots
  std::vector<RowSighting> rows;
};

struct WatchInput {
  const Calibration& calibration;                                          ///< with its quality
  std::vector<WatchView> views;                                            ///< of one pose
  Eigen::Matrix3d rectified_from_turntable = Eigen::Matrix3d::Identity();  ///< axes in which row offsets are measured
  double rectified_focal_px = 0.0;
};

/// What dots and rows determine.
struct RigFit {
  PoseChange change = PoseChange::Zero();  ///< with the prior given
  PoseMatrix normal = PoseMatrix::Zero();  ///< normal equations without a prior: normal * change = right
  PoseChange right = PoseChange::Zero();   ///< angles eliminated
  std::vector<double> angles_rad;          ///< true angle of each view
  double angle_offset_rad = 0.0;           ///< common part of true minus reported angle: the table's zero
  double angle_rms_rad = 0.0;              ///< of what is left of that difference
  double rows_rms_px = 0.0;                ///< of the row offsets measured
  int rows = 0;
  std::array<int, 2> dots{};               ///< used per camera
  Eigen::Vector2d dot_sigma_px{0.0, 0.0};  ///< of one dot, by what the fit leaves
};

/// Poses of both cameras and the table's angles, by least squares, robustly; lenses and dots as calibrated.
/// `prior`: covariance of the change. Threads: any. Same input, same bits.
RigFit fit_rig(const WatchInput& input, const PoseMatrix& prior);

}  // namespace scanrig
