#include "pipeline/calibration/watch/rig_priors.h"

#include <Eigen/Dense>
#include <cmath>

#include "core/units.h"

namespace scanrig {
namespace {

constexpr int kLens = 9, kCamera = 15;

/// A camera turns about its own centre; PoseChange turns about the table's origin.
Eigen::Matrix<double, 6, 6> own_motion(const Camera& camera, const RigDrift& drift) {
  Eigen::Matrix<double, 6, 6> by = Eigen::Matrix<double, 6, 6>::Identity();
  by.bottomLeftCorner<3, 3>() = -cross_matrix(camera.camera_from_turntable.translation());
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << drift.rows_px / camera.projection.fy, drift.columns_px / camera.projection.fx, drift.roll_rad,
      drift.camera_mm, drift.camera_mm, drift.camera_mm;
  return by * sigma.cwiseAbs2().asDiagonal() * by.transpose();
}

Eigen::Matrix<double, 12, 5> motion_of_table(const Calibration& calibration) {
  Eigen::Matrix<double, 12, 5> by = Eigen::Matrix<double, 12, 5>::Zero();
  for (int c = 0; c < 2; ++c) {
    const Eigen::Matrix3d rotation = (c == 0 ? calibration.left : calibration.right).camera_from_turntable.linear();
    by.block<3, 3>(6 * c + 3, 0) = rotation;
    by.block<3, 1>(6 * c, 3) = rotation.col(0);
    by.block<3, 1>(6 * c, 4) = rotation.col(2);
  }
  return by;
}

/// What the frame's height, azimuth and scale are, seen from both cameras.
Eigen::Matrix<double, 12, 3> shared_with_dots(const Calibration& calibration) {
  Eigen::Matrix<double, 12, 3> by = Eigen::Matrix<double, 12, 3>::Zero();
  for (int c = 0; c < 2; ++c) {
    const Transform& pose = (c == 0 ? calibration.left : calibration.right).camera_from_turntable;
    by.block<3, 1>(6 * c + 3, 0) = pose.linear().col(1);
    by.block<3, 1>(6 * c, 1) = pose.linear().col(1);
    by.block<3, 1>(6 * c + 3, 2) = pose.translation() / pose.translation().norm();
  }
  return by;
}

/// Covariance of the poses once the lenses are as calibrated.
PoseMatrix poses_given_lenses(const CalibrationQuality& quality) {
  Eigen::Matrix<double, 2 * kLens, 2 * kLens> lens;
  Eigen::Matrix<double, 12, 2 * kLens> both;
  PoseMatrix pose;
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 2; ++b) {
      const auto& all = quality.cameras;
      lens.block<kLens, kLens>(kLens * a, kLens * b) = all.block<kLens, kLens>(kCamera * a, kCamera * b);
      both.block<6, kLens>(6 * a, kLens * b) = all.block<6, kLens>(kCamera * a + kLens, kCamera * b);
      pose.block<6, 6>(6 * a, 6 * b) = all.block<6, 6>(kCamera * a + kLens, kCamera * b + kLens);
    }
  }
  // In units of each unknown's sigma, and a little surer of nothing: a held unknown has no variance.
  const Eigen::VectorXd unit = lens.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = unit.asDiagonal() * lens * unit.asDiagonal();
  scaled.diagonal().array() += 1e-9;
  const Eigen::MatrixXd by_lens = both * unit.asDiagonal();
  return pose - by_lens * scaled.ldlt().solve(by_lens.transpose());
}

}  // namespace

RigDrift RigDrift::scaled(double factor) const {
  return {factor * rows_px,   factor * columns_px, factor * roll_rad,
          factor * camera_mm, factor * table_mm,   factor * table_tilt_deg};
}

RigPriors rig_priors(const Calibration& calibration, const CalibrationQuality& quality, const RigDrift& drift) {
  RigPriors priors;
  for (int c = 0; c < 2; ++c) {
    priors.camera[c].setZero();
    priors.camera[c].block<6, 6>(6 * c, 6 * c) = own_motion(c == 0 ? calibration.left : calibration.right, drift);
  }
  priors.pose_by_table = motion_of_table(calibration);
  priors.table_variance.head<3>().setConstant(drift.table_mm * drift.table_mm);
  priors.table_variance.tail<2>().setConstant(std::pow(to_radians(drift.table_tilt_deg), 2));
  const PoseMatrix information = (priors.camera[0] + priors.camera[1]).inverse();
  const auto modes = shared_with_dots(calibration);
  const Eigen::Matrix<double, 3, 12> weighted = modes.transpose() * information;
  const PoseMatrix rest = PoseMatrix::Identity() - modes * (weighted * modes).inverse() * weighted;
  priors.calibration = rest * poses_given_lenses(quality) * rest.transpose();
  return priors;
}

}  // namespace scanrig
