#include "pipeline/registration/pose_uncertainty.h"

#include <gtest/gtest.h>

#include <random>

#include "core/units.h"

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// The frame of a turntable whose axis is off.
Transform frame_off(const Eigen::Vector3d& turn, const Eigen::Vector3d& shift) {
  Transform off = Transform::Identity();
  off.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  off.translation() = shift;
  return off;
}

/// Error of a motion at `centre`: rotation vector and translation.
Vector6 error_of(const Transform& seen, const Transform& true_motion, const Eigen::Vector3d& centre) {
  const Transform off = seen * true_motion.inverse();
  const Eigen::AngleAxisd turn(off.linear());
  Vector6 error;
  error << turn.angle() * turn.axis(), off * centre - centre;
  return error;
}

TEST(PoseUncertainty, AWrongAxisSpreadsTheMotionAsPredicted) {
  const AxisUncertainty axis{to_radians(0.01), 0.02};
  Transform motion = Transform::Identity();
  motion.linear() =
      Eigen::AngleAxisd(to_radians(140.0), Eigen::Vector3d(0.8, 0.1, 0.6).normalized()).toRotationMatrix();
  motion.translation() = Eigen::Vector3d(4.0, 70.0, -9.0);
  const Eigen::Vector3d centre(5.0, 40.0, 8.0);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> spread = Eigen::Matrix<double, 6, 6>::Zero();
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Transform frame = frame_off(axis.tilt_rad * Eigen::Vector3d(normal(random), 0.0, normal(random)),
                                      axis.shift_mm * Eigen::Vector3d(normal(random), 0.0, normal(random)));
    const Vector6 error = error_of(frame * motion * frame.inverse(), motion, centre);
    spread += error * error.transpose() / kTrials;
  }
  const auto predicted = axis_covariance(motion, centre, axis);
  const Vector6 sigma = predicted.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(spread(i, j), predicted(i, j), 0.05 * sigma[i] * sigma[j]) << i << " " << j;
  }
}

TEST(PoseUncertainty, NothingOfAMotionThatIsNone) {
  const auto none = axis_covariance(Transform::Identity(), {1.0, 50.0, 2.0}, {to_radians(0.01), 0.02});
  EXPECT_LT(none.norm(), 1e-20);
}

}  // namespace
}  // namespace scanrig
