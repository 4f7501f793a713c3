#include "pipeline/range/thinned_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "pipeline/range/crop_view.h"

namespace scanrig {
namespace {

/// A disc of 120 px radius, in steps from pixel to pixel, before a screen.
View disc() {
  const cv::Size size(1000, 700);
  View view;
  view.range.projection = {.width = size.width, .height = size.height, .fx = 900, .fy = 900, .cx = 510, .cy = 340};
  view.range.window_px = 6.0F;
  view.range.depth = cv::Mat1f(size, kUnmeasured);
  view.range.sigma = view.range.depth.clone();
  view.range.normal = cv::Mat3f(size, cv::Vec3f(kUnmeasured, kUnmeasured, kUnmeasured));
  view.range.background = cv::Mat1b(size, uchar{0});
  view.silhouettes.resize(2);
  for (Silhouette& s : view.silhouettes) {
    s.projection = view.range.projection;
    s.outside_px = cv::Mat1f(size);
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) s.outside_px(v, u) = static_cast<float>(std::hypot(u - 610, v - 300)) - 120;
    }
  }
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      view.range.background(v, u) = view.silhouettes[0].outside_px(v, u) > 1.0F ? 255 : 0;
      if (view.silhouettes[0].outside_px(v, u) > -2.0F) continue;
      view.range.depth(v, u) = 600.0F + 0.01F * static_cast<float>(u + 3 * v);
      view.range.sigma(v, u) = 0.02F;
      view.range.normal(v, u) = {0, 0, -1};
    }
  }
  return view;
}

TEST(ThinnedView, LargeImagesAreThinnedToThoseOfAMegapixel) {
  EXPECT_EQ(thinning_step({.width = 1280, .height = 960}), 1);
  EXPECT_EQ(thinning_step({.width = 1920, .height = 1200}), 1);
  EXPECT_EQ(thinning_step({.width = 2448, .height = 2048}), 2);
  EXPECT_EQ(thinning_step({.width = 4096, .height = 3000}), 3);
}

TEST(ThinnedView, APixelShowsTheSamePointAndTheSameDistanceToTheOutline) {
  View whole = disc();
  crop_to_object_in_steps(whole, 3);
  ASSERT_TRUE(whole.range.projection.is_cropped());
  const View thin = thinned(whole, 3);
  const Projection &p = whole.range.projection, &t = thin.range.projection;
  EXPECT_EQ(thin.range.depth.size(), cv::Size(t.width, t.height));
  EXPECT_EQ(3 * t.crop_x, p.crop_x);
  EXPECT_EQ(3 * t.crop_y, p.crop_y);
  for (int v = 0; v < t.height; ++v) {
    for (int u = 0; u < t.width; ++u) {
      EXPECT_EQ(thin.range.background(v, u), whole.range.background(3 * v, 3 * u));
      EXPECT_NEAR(thin.silhouettes[1].outside_px(v, u), whole.silhouettes[1].outside_px(3 * v, 3 * u) / 3, 1e-5);
      const float depth = whole.range.depth(3 * v, 3 * u);
      ASSERT_EQ(std::isnan(thin.range.depth(v, u)), std::isnan(depth));
      if (std::isnan(depth)) continue;
      const Eigen::Vector3d same = t.unproject(u, v, thin.range.depth(v, u)) - p.unproject(3 * u, 3 * v, depth);
      EXPECT_LT(same.norm(), 1e-9);
    }
  }
  EXPECT_NEAR(thin.range.window_px * t.mm_per_pixel(600), whole.range.window_px * p.mm_per_pixel(600), 1e-6);
}

TEST(ThinnedView, DoubtedBackgroundAndPixelsTakenInAgainReachTheWholeRangeImage) {
  View whole = disc();
  crop_to_object_in_steps(whole, 3);
  View thin = thinned(whole, 3);
  CompactRange full(whole.range);
  follow_thinned(full, thin.range, 3);
  const RangeImage before = full.whole();
  EXPECT_EQ(before.projection.width, whole.range.projection.width);
  EXPECT_EQ(cv::countNonZero(before.background != whole.range.background), 0);

  const cv::Point doubted(20, 15);  // of the thinned image, beside the object
  ASSERT_EQ(thin.range.background(doubted), 255);
  uncrop(thin, 0, cv::Rect(-60, 0, 30, 30));
  const cv::Point moved(whole.range.projection.crop_x / 3 - thin.range.projection.crop_x,
                        whole.range.projection.crop_y / 3 - thin.range.projection.crop_y);
  ASSERT_GT(moved.x, 0);
  thin.range.background = thin.range.background.clone();
  thin.range.background(doubted + moved) = 0;
  thin.range.camera_from_pose.translation().x() = 7.0;
  follow_thinned(full, thin.range, 3);
  const RangeImage after = full.whole();
  EXPECT_EQ(after.camera_from_pose.translation().x(), 7.0);
  EXPECT_EQ(after.projection.crop_x, 3 * thin.range.projection.crop_x);
  EXPECT_EQ(after.depth.size(), after.background.size());
  EXPECT_EQ(cv::countNonZero(after.background == 0), cv::countNonZero(before.background == 0) + 9);
  EXPECT_EQ(after.background(3 * (doubted + moved)), 0);
  EXPECT_EQ(cv::countNonZero(after.depth == after.depth), cv::countNonZero(before.depth == before.depth));
}

}  // namespace
}  // namespace scanrig
