#include "core/transform.h"

#include <gtest/gtest.h>

#include <numbers>

namespace scanrig {
namespace {

TEST(Transform, TheTableTurnsCounterClockwiseSeenFromAbove) {
  // Seen from +Y with +X to the right, +Z points down: counter-clockwise carries +X to -Z.
  const Eigen::Vector3d turned = rot_y(std::numbers::pi / 2) * Eigen::Vector3d::UnitX();
  EXPECT_NEAR((turned + Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-12);
}

TEST(Transform, RotationAngleIsAccurateNearZeroAndNearPi) {
  for (const double angle : {1e-9, 1e-4, 1.0, 3.1415}) {
    EXPECT_NEAR(rotation_angle(small_motion(angle * Eigen::Vector3d(1, 2, -2).normalized(), {}).linear()), angle,
                1e-11);
  }
}

}  // namespace
}  // namespace scanrig
