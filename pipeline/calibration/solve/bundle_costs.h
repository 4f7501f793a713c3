#pragma once

#include <vector>

#include "pipeline/calibration/solve/unknowns.h"

namespace ceres {
class CostFunction;
class Manifold;
}  // namespace ceres

namespace scanrig {

/// Terms of the bundle; each is owned by who calls. Rows are in sigma.
/// A corner. Blocks: lens, camera pose, motion, placement, shape, offset; with the field its sixteen coefficients.
ceres::CostFunction* corner_cost(const Eigen::Vector2d& pixel, const Eigen::Vector2d& place,
                                 const Eigen::Vector2d& share, const LensFieldSupport* field, double sigma);
/// A rim dot. Blocks: lens, camera pose, motion, the dot; with the field its sixteen coefficients.
ceres::CostFunction* dot_cost(const Eigen::Vector2d& pixel, const LensFieldSupport* field, double sigma);
/// (x - mean) / sigma, element by element. Block: x.
ceres::CostFunction* prior_cost(const std::vector<double>& mean, const std::vector<double>& sigma);
/// Motion of the table at a reported angle. Blocks: motion, gear.
ceres::CostFunction* motion_cost(double reported_rad, double angle_sigma, double tilt_sigma, double shift_sigma);
/// The midpoint of the camera centres lies at x = 0. Blocks: one or two camera poses.
ceres::CostFunction* azimuth_cost(int cameras, double sigma);
/// The board's middle is `height` above y = 0. Block: placement.
ceres::CostFunction* height_cost(double height, double sigma);
/// Offsets have no shift, turn, scale, aspect, shear or quadratic warp in common. Blocks: the offset of every corner.
ceres::CostFunction* offset_modes_cost(const Board& board, double sigma);

/// The distance of two corners, each with its offset, is the measured one. Blocks: shape, both offsets.
ceres::CostFunction* length_cost(const Board& board, const MeasuredLength& length);

ceres::Manifold* pose_manifold();  ///< of a PoseBlock, changed on the left

}  // namespace scanrig
