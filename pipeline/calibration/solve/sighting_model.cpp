#include "pipeline/calibration/solve/sighting_model.h"

#include <cmath>

namespace scanrig {
namespace {

using Rows = Eigen::Matrix<double, 2, 3>;

Eigen::Matrix3d rotation_of(const double* pose) {
  return Eigen::Quaterniond(pose[0], pose[1], pose[2], pose[3]).normalized().toRotationMatrix();
}

/// Derivative of by_point * (exp(rotation) * turned + shift) by rotation and shift.
void by_pose(const Rows& by_point, const Eigen::Vector3d& turned, Eigen::Matrix<double, 2, 6>& out) {
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d a = by_point.row(row).transpose();
    out.row(row).head<3>() = turned.cross(a).transpose();
    out.row(row).tail<3>() = a.transpose();
  }
}

}  // namespace

Eigen::Vector2d lens_pixel(const double* lens, const Eigen::Vector3d& p, Eigen::Matrix<double, 2, 9>* by_lens,
                           Rows* by_point) {
  const double fx = lens[0], fy = lens[0] * lens[1];
  const double k1 = lens[4], k2 = lens[5], p1 = lens[6], p2 = lens[7], k3 = lens[8];
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  if (by_lens) {
    *by_lens << xd, 0.0, 1.0, 0.0, fx * x * r2, fx * x * r2 * r2, fx * 2.0 * x * y, fx * (r2 + 2.0 * x * x),
        fx * x * r2 * r2 * r2, lens[1] * yd, lens[0] * yd, 0.0, 1.0, fy * y * r2, fy * y * r2 * r2,
        fy * (r2 + 2.0 * y * y), fy * 2.0 * x * y, fy * y * r2 * r2 * r2;
  }
  if (by_point) {
    const double slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3));
    Eigen::Matrix2d bent;
    bent(0, 0) = fx * (radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x);
    bent(0, 1) = fx * (x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y);
    bent(1, 0) = fy * (x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y);
    bent(1, 1) = fy * (radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x);
    Rows plane;
    plane << 1.0, 0.0, -x, 0.0, 1.0, -y;
    *by_point = bent * plane / p.z();
  }
  return {fx * xd + lens[2], fy * yd + lens[3]};
}

Eigen::Vector2d table_pixel(const double* lens, const double* camera, const double* motion,
                            const Eigen::Vector3d& point_in_table, PixelJacobians* jacobians, Rows* by_point) {
  const double c = std::cos(motion[0]), s = std::sin(motion[0]);
  const auto turn = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(c * p.x() + s * p.z(), p.y(), c * p.z() - s * p.x());
  };
  const Eigen::Vector3d turned = turn(point_in_table);
  const Eigen::Vector3d tilt(motion[1], 0.0, motion[2]);
  const Eigen::Vector3d moved = turned + tilt.cross(turned) + Eigen::Vector3d(motion[3], motion[4], motion[5]);
  const Eigen::Matrix3d rotation = rotation_of(camera);
  const Eigen::Vector3d in_camera_axes = rotation * moved;
  const Eigen::Vector3d in_camera = in_camera_axes + Eigen::Vector3d(camera[4], camera[5], camera[6]);
  if (!jacobians) return lens_pixel(lens, in_camera, nullptr, nullptr);

  Rows by_camera_point;
  const Eigen::Vector2d pixel = lens_pixel(lens, in_camera, &jacobians->lens, &by_camera_point);
  by_pose(by_camera_point, in_camera_axes, jacobians->camera);
  const Rows by_moved = by_camera_point * rotation;
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d a = by_moved.row(row).transpose();
    const Eigen::Vector3d by_tilt = turned.cross(a);
    const Eigen::Vector3d by_turned = a + a.cross(tilt);
    jacobians->motion.row(row) << by_turned.x() * turned.z() - by_turned.z() * turned.x(), by_tilt.x(), by_tilt.z(),
        a.x(), a.y(), a.z();
    by_point->row(row) << c * by_turned.x() - s * by_turned.z(), by_turned.y(), s * by_turned.x() + c * by_turned.z();
  }
  return pixel;
}

Eigen::Vector3d corner_in_board(const double* shape, const double* offset, const Eigen::Vector2d& place,
                                const Eigen::Vector2d& share, Eigen::Matrix<double, 3, 6>* by_shape) {
  const double scale = 1.0 + shape[0], x = place.x(), y = place.y();
  const Eigen::Vector3d print((1.0 + 0.5 * shape[1]) * x + 0.5 * shape[2] * y,
                              (1.0 - 0.5 * shape[1]) * y + 0.5 * shape[2] * x, 0.0);
  const Eigen::Vector3d bend(share.x() * share.x(), share.x() * share.y(), share.y() * share.y());
  if (by_shape) {
    by_shape->setZero();
    by_shape->col(0) = print;
    by_shape->col(1) << 0.5 * scale * x, -0.5 * scale * y, 0.0;
    by_shape->col(2) << 0.5 * scale * y, 0.5 * scale * x, 0.0;
    by_shape->row(2).tail<3>() = bend;
  }
  Eigen::Vector3d in_board = scale * print + Eigen::Vector3d(offset[0], offset[1], offset[2]);
  in_board.z() += shape[3] * bend.x() + shape[4] * bend.y() + shape[5] * bend.z();
  return in_board;
}

Eigen::Vector2d corner_pixel(const double* lens, const double* camera, const double* motion, const double* placement,
                             const double* shape, const double* offset, const Eigen::Vector2d& place,
                             const Eigen::Vector2d& share, PixelJacobians* jacobians) {
  Eigen::Matrix<double, 3, 6> by_shape;
  const Eigen::Vector3d in_board = corner_in_board(shape, offset, place, share, jacobians ? &by_shape : nullptr);
  const Eigen::Matrix3d rotation = rotation_of(placement);
  const Eigen::Vector3d in_table_axes = rotation * in_board;
  const Eigen::Vector3d in_table = in_table_axes + Eigen::Vector3d(placement[4], placement[5], placement[6]);
  Rows by_table;
  const Eigen::Vector2d pixel = table_pixel(lens, camera, motion, in_table, jacobians, &by_table);
  if (!jacobians) return pixel;
  by_pose(by_table, in_table_axes, jacobians->placement);
  jacobians->point = by_table * rotation;
  jacobians->shape = jacobians->point * by_shape;
  return pixel;
}

}  // namespace scanrig
