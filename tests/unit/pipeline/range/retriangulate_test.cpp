#include "pipeline/range/retriangulate.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/units.h"
#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

constexpr double kAngle = 0.3;

/// Rig and ball; both cameras have moved since the calibration.
struct MovedRig {
  Calibration was = test::default_rig({200, 160});
  Calibration is = was;
  Rectification rectification = *rectify(was, {25.0, 90.0});
  test::Surface ball = test::ball({0, 45, 0}, 10);

  MovedRig() {
    is.right.camera_from_turntable =
        small_motion({1e-5, 4e-5, 2e-5}, {0.01, 0.0, -0.02}) * is.right.camera_from_turntable;
    is.left.camera_from_turntable =
        small_motion({0.0, -2e-5, 1e-5}, {0.02, 0.01, 0.01}) * is.left.camera_from_turntable;
  }
  /// As matched: true lines of sight, depth by the calibration as it was.
  [[nodiscard]] View matched(const MovedFrames& frames, const cv::Mat1f& truth) const {
    View view;
    view.range = {rectification.left, rectification.left_from_turntable, truth.clone(), {}, {}, {}};
    view.range.sigma = cv::Mat1f(truth.size(), 0.02F);
    view.silhouettes.resize(2);
    const Transform right_from_left = frames.right_from_turntable * frames.left_from_turntable.inverse();
    for (int v = 0; v < truth.rows; ++v) {
      for (int u = 0; u < truth.cols; ++u) {
        if (std::isnan(truth(v, u))) continue;
        const Eigen::Vector3d p = rectification.left.unproject(u, v, static_cast<double>(truth(v, u)));
        const Eigen::Vector3d q = right_from_left * p;
        view.range.depth(v, u) = static_cast<float>(rectification.baseline_mm / (p.x() / p.z() - q.x() / q.z()));
      }
    }
    return view;
  }
};

TEST(Retriangulate, GivesTheDepthOfTheMovedCameras) {
  const MovedRig rig;
  const MovedFrames frames = carry_frames(rig.rectification, rig.was, rig.is);
  const cv::Mat1f truth = test::true_depth(rig.rectification.left, frames.left_from_turntable, rig.ball);
  View view = rig.matched(frames, truth);
  const auto farthest = [&] {
    double far = 0.0;
    for (int v = 0; v < truth.rows; ++v) {
      for (int u = 0; u < truth.cols; ++u) {
        if (!std::isnan(truth(v, u))) far = std::max(far, double(std::abs(view.range.depth(v, u) - truth(v, u))));
      }
    }
    return far;
  };
  EXPECT_GT(farthest(), 0.1);
  retriangulate(view, rig.rectification, frames, kAngle);
  EXPECT_LT(farthest(), 2e-4);
  EXPECT_NEAR(view.range.sigma(80, 100), 0.02F, 1e-4F);
}

TEST(Retriangulate, PutsTheViewWhereTheCamerasAre) {
  const MovedRig rig;
  const MovedFrames frames = carry_frames(rig.rectification, rig.was, rig.is);
  View view = rig.matched(frames, cv::Mat1f(160, 200, 600.0F));
  retriangulate(view, rig.rectification, frames, kAngle);
  EXPECT_EQ(view.angle_rad, kAngle);
  // A point that the moved left camera sees in its middle is in the rectified image where that line of sight was.
  const Eigen::Vector3d in_camera = rig.is.left.camera_from_turntable.inverse() * Eigen::Vector3d(0, 0, 640);
  const Eigen::Vector3d seen = view.range.camera_from_pose * rot_y(-kAngle) * in_camera;
  const Eigen::Vector3d before =
      rig.rectification.left_from_turntable * rig.was.left.camera_from_turntable.inverse() * Eigen::Vector3d(0, 0, 640);
  EXPECT_LT((seen - before).norm(), 1e-9);
  EXPECT_TRUE(view.silhouettes[0].camera_from_pose.isApprox(view.range.camera_from_pose));
  EXPECT_TRUE(view.silhouettes[1].camera_from_pose.isApprox(frames.right_from_turntable * rot_y(kAngle)));
}

TEST(Retriangulate, OfCamerasThatHaveNotMovedChangesNothing) {
  const MovedRig rig;
  const MovedFrames frames = carry_frames(rig.rectification, rig.was, rig.was);
  const cv::Mat1f truth = test::true_depth(rig.rectification.left, frames.left_from_turntable, rig.ball);
  View view = rig.matched(frames, truth);
  retriangulate(view, rig.rectification, frames, kAngle);
  cv::Mat1f apart;
  cv::absdiff(view.range.depth, truth, apart);
  cv::patchNaNs(apart, 0.0);
  EXPECT_LT(cv::norm(apart, cv::NORM_INF), 2e-4);
}

}  // namespace
}  // namespace scanrig
