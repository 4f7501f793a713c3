#include "core/transform.h"

#include <cmath>

namespace scanrig {

Transform rot_y(double radians) {
  Transform transform = Transform::Identity();
  transform.linear() = Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return transform;
}

double rotation_angle(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d axis(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                             rotation(1, 0) - rotation(0, 1));
  return std::atan2(axis.norm(), rotation.trace() - 1.0);
}

Transform small_motion(const Eigen::Vector3d& rotation_vector, const Eigen::Vector3d& translation) {
  Transform transform = Transform::Identity();
  const double angle = rotation_vector.norm();
  if (angle > 0.0) {
    transform.linear() = Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
  }
  transform.translation() = translation;
  return transform;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace scanrig
