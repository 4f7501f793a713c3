#include "pipeline/evaluate/frame_height.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/evaluate/ball_truth.h"

namespace scanrig {
namespace {

using namespace ball_truth;

/// The truth's cameras as seen from a frame that is moved by `by`.
Calibration calibration_of(const Truth& truth, const Eigen::Vector3d& by) {
  Calibration calibration;
  calibration.left = truth.left;
  calibration.right = truth.right;
  for (Camera* camera : {&calibration.left, &calibration.right}) camera->camera_from_turntable.translate(by);
  return calibration;
}

TEST(FrameHeight, IsWhatTheOriginsDifferAlongTheAxis) {
  const Truth truth = rig_and_ball({0.0});
  EXPECT_NEAR(frame_height(calibration_of(truth, {0.0, 0.0, 0.0}), truth), 0.0, 1e-9);
  EXPECT_NEAR(frame_height(calibration_of(truth, {0.0, 0.05, 0.0}), truth), 0.05, 1e-9);
  EXPECT_NEAR(frame_height(calibration_of(truth, {0.1, -0.2, 0.1}), truth), -0.2, 1e-9)
      << "an axis that is off stays off";
}

TEST(FrameHeight, OfARaisedClaimIsNothing) {
  Claim claim;
  claim.model.mesh = ball();
  const Eigen::Vector3f before = claim.model.mesh.vertices.front();
  claim.pose1_from_pose2 = Transform(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d point(3.0, 40.0, -7.0), up(0.0, 0.05, 0.0);
  const Eigen::Vector3d meant = *claim.pose1_from_pose2 * point + up;
  const Claim high = raised(claim, 0.05);
  EXPECT_NEAR(high.model.mesh.vertices.front().y() - before.y(), 0.05, 1e-5);
  EXPECT_NEAR((*high.pose1_from_pose2 * (point + up) - meant).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace scanrig
