#include "pipeline/range/view_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

using test::Surface;

const Eigen::Vector3d kBall(2, 44, 3);
constexpr double kRadius = 9.0;

struct Rig {
  Calibration calibration = test::default_rig({360, 280});
  Rectification rectification = *rectify(calibration, {20.0, 80.0});

  [[nodiscard]] StereoImages shoot(const Surface& surface, const test::Look& look = {}) const {
    test::Look dots = look, plain = look;
    plain.dots = false;
    StereoImages images;
    images.left_pattern = test::render(calibration.left, surface, dots);
    images.left_plain = test::render(calibration.left, surface, plain);
    dots.seed = plain.seed = 2;
    images.right_pattern = test::render(calibration.right, surface, dots);
    images.right_plain = test::render(calibration.right, surface, plain);
    return images;
  }
};

TEST(ViewBuilder, PutsTheSurfaceAtItsPlaceInTheTurnedBackPose) {
  const Rig rig;
  const double angle = 0.7;
  const auto view = make_view(rig.rectification, rig.shoot(test::ball(kBall, kRadius)), angle, 3, {}, {});
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->index, 3);
  EXPECT_EQ(view->angle_rad, angle);
  const Eigen::Vector3d centre = rot_y(-angle) * kBall;
  const Transform pose_from_camera = view->range.camera_from_pose.inverse();
  int measured = 0;
  for (int v = 0; v < view->range.depth.rows; ++v) {
    for (int u = 0; u < view->range.depth.cols; ++u) {
      if (std::isnan(view->range.depth(v, u))) continue;
      const double depth = static_cast<double>(view->range.depth(v, u));
      const Eigen::Vector3d p = pose_from_camera * view->range.projection.unproject(u, v, depth);
      ASSERT_NEAR((p - centre).norm(), kRadius, 0.3);
      ++measured;
    }
  }
  EXPECT_GT(measured, 7000);
}

TEST(ViewBuilder, DrawsBothSilhouettesAndTheBackground) {
  const Rig rig;
  const auto view = make_view(rig.rectification, rig.shoot(test::ball(kBall, kRadius)), 0.7, 0, {}, {});
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_EQ(view->silhouettes.size(), 2u);
  const Eigen::Vector3d centre = rot_y(-0.7) * kBall;
  for (const Silhouette& silhouette : view->silhouettes) {
    const Eigen::Vector3d c = silhouette.camera_from_pose * centre;
    double worst = 0.0;
    for (int v = 0; v < silhouette.outside_px.rows; ++v) {
      for (int u = 0; u < silhouette.outside_px.cols; ++u) {
        // Angle from the centre's direction, against that of the tangent cone.
        const Eigen::Vector3d ray = silhouette.projection.unproject(u, v, 1.0).normalized();
        const double beyond = std::asin(ray.cross(c.normalized()).norm()) - std::asin(kRadius / c.norm());
        const double true_px = beyond * silhouette.projection.fx;
        if (std::abs(true_px) < 2.0) {
          worst = std::max(worst, std::abs(static_cast<double>(silhouette.outside_px(v, u)) - true_px));
        }
      }
    }
    EXPECT_LT(worst, 0.6);
  }
  const cv::Mat1f& outside = view->silhouettes.front().outside_px;
  for (int v = 0; v < outside.rows; ++v) {
    for (int u = 0; u < outside.cols; ++u) {
      if (view->range.background(v, u) != 0) {
        EXPECT_GT(outside(v, u), 0.5f);
        EXPECT_TRUE(std::isnan(view->range.depth(v, u)));
      } else {
        EXPECT_LT(outside(v, u), 1.5f);
      }
    }
  }
}

TEST(ViewBuilder, SeparatesGreyObjectsFromTheTableByHeight) {
  const Calibration high = test::default_rig({300, 540});  // down to the table
  const Rig rig{high, *rectify(high, {20.0, 80.0})};
  const Surface scene = test::nearest_of(test::ball({0, 22, 0}, 10), test::disc({0, 0, 0}, {0, 1, 0}, 60));
  StereoImages images = rig.shoot(scene);
  for (cv::Mat* image : {&images.left_pattern, &images.right_pattern}) cv::cvtColor(*image, *image, cv::COLOR_BGR2GRAY);
  images.left_plain = images.right_plain = cv::Mat();
  const auto view = make_view(rig.rectification, images, 0.0, 0, {}, {});
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_EQ(view->silhouettes.size(), 2u);
  EXPECT_FALSE(view->range.background_is_whole);
  // What is matched with the table is free; the ball is not, nor what nothing lights.
  const cv::Mat1b table(test::true_depth(rig.rectification.left, rig.rectification.left_from_turntable,
                                         test::disc({0, 0, 0}, {0, 1, 0}, 60)) > 0.0f);
  const cv::Mat1b ball(test::true_depth(rig.rectification.left, rig.rectification.left_from_turntable,
                                        test::ball({0, 22, 0}, 10)) > 0.0f);
  const cv::Mat1b& background = view->range.background;
  EXPECT_EQ(cv::countNonZero(background & ball), 0);
  EXPECT_GT(cv::countNonZero(background & table), 0.4 * cv::countNonZero(table & ~ball));
  EXPECT_EQ(cv::countNonZero((view->silhouettes[0].outside_px > 0.5f) & ball), 0);
  const Transform turntable_from_camera = view->range.camera_from_pose.inverse();
  for (int v = 0; v < view->range.depth.rows; ++v) {
    for (int u = 0; u < view->range.depth.cols; ++u) {
      const double depth = static_cast<double>(view->range.depth(v, u));
      if (std::isnan(depth)) continue;
      EXPECT_GE((turntable_from_camera * view->range.projection.unproject(u, v, depth)).y(), 0.5);
    }
  }
}

int measured_pixels(const View& view) { return cv::countNonZero(view.range.depth == view.range.depth); }

TEST(ViewBuilder, MeasuresWithoutSilhouettesWhereThereIsNoScreenOfOneColour) {
  const Rig rig;
  const auto view = make_view(
      rig.rectification, rig.shoot(test::ball(kBall, kRadius), {.screen = {70, 70, 70}, .object = {110, 120, 130}}),
      0.0, 0, {}, {});
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_FALSE(view->range.background_is_whole);
  const cv::Mat1b shown(test::true_depth(rig.rectification.left, rig.rectification.left_from_turntable,
                                         test::ball(kBall, kRadius)) > 0.0f);
  EXPECT_EQ(cv::countNonZero(view->range.background & shown), 0);
  EXPECT_GT(measured_pixels(*view), 7000);
}

TEST(ViewBuilder, MeasuresAnObjectInTheScreensColour) {
  const Rig rig;
  const auto view =
      make_view(rig.rectification, rig.shoot(test::ball(kBall, kRadius), {.object = {150, 50, 20}}), 0.0, 0, {}, {});
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_FALSE(view->range.background_is_whole);
  EXPECT_GT(measured_pixels(*view), 7000);
}

ErrorCode failure(const Rig& rig, const StereoImages& images, const Context& context = {}) {
  const auto view = make_view(rig.rectification, images, 0.0, 0, {}, context);
  return view ? ErrorCode::internal : view.error().code;
}

TEST(ViewBuilder, ReportsAnObjectLargerThanTheWorkingVolume) {
  const Rig rig;
  EXPECT_EQ(failure(rig, rig.shoot(test::ball({0, 45, 0}, 23))), ErrorCode::out_of_range);
}

TEST(ViewBuilder, ReportsAnEmptyTable) {
  const Rig rig;
  EXPECT_EQ(failure(rig, rig.shoot(test::ball({0, -500, 0}, 1))), ErrorCode::degenerate);
}

TEST(ViewBuilder, RefusesImagesOfAnotherSizeAndStopsOnRequest) {
  const Rig rig;
  StereoImages images = rig.shoot(test::ball(kBall, kRadius));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(failure(rig, images, {stop.get_token(), {}}), ErrorCode::stopped);
  images.right_plain = cv::Mat3b(10, 10);
  EXPECT_EQ(failure(rig, images), ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
