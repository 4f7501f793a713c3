#pragma once

#include <Eigen/Geometry>

namespace scanrig {

/// A rigid motion. Names put the target first: `camera_from_turntable * point_in_turntable`.
using Transform = Eigen::Isometry3d;

/// Counter-clockwise seen from above (+Y up, right-handed): the table at angle theta carries X to rot_y(theta) * X.
Transform rot_y(double radians);

/// Angle of a rotation in radians, 0..pi, accurate near 0.
double rotation_angle(const Eigen::Matrix3d& rotation);

/// Rigid motion of a small rotation vector (radians) and a translation: exp(rotation), then the translation added.
Transform small_motion(const Eigen::Vector3d& rotation_vector, const Eigen::Vector3d& translation);

/// The matrix whose product with w is v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

}  // namespace scanrig
