#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "pipeline/calibration/camera.h"

namespace scanrig {

/// Changes of both cameras' poses, left first: turn (rad) and shift (mm) of the table in the camera frame, the turn
/// about the table's origin: a point X of the turntable frame is seen at R X + turn x (R X) + t + shift. As in
/// CalibrationQuality::cameras.
using PoseChange = Eigen::Matrix<double, 12, 1>;
using PoseMatrix = Eigen::Matrix<double, 12, 12>;
using PixelByPose = Eigen::Matrix<double, 2, 6>;

/// The calibration with both cameras' poses changed.
Calibration moved(const Calibration& calibration, const PoseChange& change);

/// Derivative of a camera's pixel by a point of the turntable frame, and by its pose.
Eigen::Matrix<double, 2, 3> pixel_by_point(const Camera& camera, const Eigen::Vector3d& point);
PixelByPose pixel_by_pose(const Camera& camera, const Eigen::Vector3d& point);

/// Derivative of a triangulated point (turntable frame, mm) by both cameras' unknowns, left first, as in
/// CalibrationQuality::cameras: how far it is put elsewhere, but for the sign.
Eigen::Matrix<double, 3, 30> point_by_cameras(const Calibration& calibration, const Eigen::Vector3d& point);

/// Points that fill the working volume, turntable frame, mm; those that both cameras see.
std::vector<Eigen::Vector3d> working_points(const Calibration& calibration);

/// What changes of the poses do, as quadratic forms: x' form x is a mean square over the working volume.
struct RigEffects {
  std::array<PoseMatrix, 2> image_px2;  ///< of the image of each camera
  PoseMatrix volume_mm2;                ///< of triangulated points; their mean height left out, which bends nothing
  double mm_per_px = 0.0;               ///< rms shift of a point for one pixel of disparity
};
RigEffects rig_effects(const Calibration& calibration);

/// How well a calibration knows the table's axis, one sigma; both directions alike.
struct AxisSigma {
  double tilt_deg = 0.0;
  double shift_mm = 0.0;  ///< at the table top
};

/// From CalibrationQuality::cameras, at the working volume: triangulated points, and the axis that fits them.
AxisSigma axis_sigma(const Calibration& calibration, const CalibrationQuality& quality);

}  // namespace scanrig
