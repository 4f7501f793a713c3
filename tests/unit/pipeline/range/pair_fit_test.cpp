#include "pipeline/range/pair_fit.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

const cv::Size kPairSize(400, 320);

struct Pair {
  Calibration calibration = test::default_rig(kPairSize);
  cv::Mat3b left, right;

  /// `turn`: of the right camera since it was calibrated, rad about its own axes.
  explicit Pair(const Eigen::Vector3d& turn = Eigen::Vector3d::Zero(), bool dots = true) {
    Camera moved = calibration.right;
    moved.camera_from_turntable = small_motion(turn, Eigen::Vector3d::Zero()) * moved.camera_from_turntable;
    const auto surface = test::ball({0, 45, 0}, 20);
    test::Look look;
    look.dots = dots;
    left = test::render(calibration.left, surface, look);
    look.seed = 2;
    right = test::render(moved, surface, look);
  }
};

TEST(PairFit, APairInItsOrderMatchesAndItsRowsCorrespond) {
  const Pair pair;
  const auto fit = fit_pair(pair.calibration, pair.left, pair.right);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_GT(fit->matched, 0.3);  // the ball has two fifths of the image
  EXPECT_LT(fit->exchanged, 0.1 * fit->matched);
  EXPECT_LT(fit->rows_px, 0.02);
}

TEST(PairFit, AnExchangedPairMatchesOnlyTheOtherWayRound) {
  const Pair pair;
  const auto fit = fit_pair(pair.calibration, pair.right, pair.left);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_GT(fit->exchanged, 0.3);
  EXPECT_LT(fit->matched, 0.1 * fit->exchanged);
}

TEST(PairFit, ATurnedCameraShowsInTheRows) {
  const double focal = test::default_rig(kPairSize).right.projection.fx;
  const Pair pair({-0.4 / focal, 0, 0});
  const auto fit = fit_pair(pair.calibration, pair.left, pair.right);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_NEAR(fit->rows_px, 0.4, 0.02);
}

TEST(PairFit, WithoutAPatternLittleMoreThanTheOutlineMatches) {
  const Pair pair(Eigen::Vector3d::Zero(), false);
  const auto fit = fit_pair(pair.calibration, pair.left, pair.right);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_LT(fit->matched, 0.15);
  EXPECT_NEAR(fit->exchanged, fit->matched, 0.05);
}

TEST(PairFit, ImagesOfAnotherSizeAreRefused) {
  const Pair pair;
  const auto fit = fit_pair(pair.calibration, pair.left(cv::Rect(0, 0, 200, 160)), pair.right);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
