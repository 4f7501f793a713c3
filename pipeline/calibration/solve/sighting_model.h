#pragma once

#include <Eigen/Core>

#include "pipeline/calibration/solve/unknowns.h"

namespace scanrig {

/// Derivatives of a pixel by the unknowns it depends on. A pose is changed on the left: exp(rotation), then a shift.
struct PixelJacobians {
  Eigen::Matrix<double, 2, 9> lens;
  Eigen::Matrix<double, 2, 6> camera, motion, placement, shape;
  Eigen::Matrix<double, 2, 3> point;  ///< corner offset, or the dot's place
};

/// Pixel, without the lens field, of a point of the turning table; `point_in_table` at table angle 0. Derivatives by
/// lens, camera and motion; returned: by the point at table angle 0.
Eigen::Vector2d table_pixel(const double* lens, const double* camera, const double* motion,
                            const Eigen::Vector3d& point_in_table, PixelJacobians* jacobians,
                            Eigen::Matrix<double, 2, 3>* by_point);

/// A corner's place in the board's frame, mm. `place`: ordered_corner(); `share`: corner_share().
Eigen::Vector3d corner_in_board(const double* shape, const double* offset, const Eigen::Vector2d& place,
                                const Eigen::Vector2d& share, Eigen::Matrix<double, 3, 6>* by_shape);

/// The same of a corner of a placed board. `place`: ordered_corner(); `share`: corner_share().
Eigen::Vector2d corner_pixel(const double* lens, const double* camera, const double* motion, const double* placement,
                             const double* shape, const double* offset, const Eigen::Vector2d& place,
                             const Eigen::Vector2d& share, PixelJacobians* jacobians);

/// Pixel of a point of the camera frame and its derivatives by the lens and the point.
Eigen::Vector2d lens_pixel(const double* lens, const Eigen::Vector3d& point_in_camera,
                           Eigen::Matrix<double, 2, 9>* by_lens, Eigen::Matrix<double, 2, 3>* by_point);

}  // namespace scanrig
