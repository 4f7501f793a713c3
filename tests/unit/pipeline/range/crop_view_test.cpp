#include "pipeline/range/crop_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "pipeline/silhouette/contour_distance.h"

namespace scanrig {
namespace {

const cv::Rect kLeftObject(300, 200, 90, 120), kRightObject(260, 210, 80, 110);

Silhouette silhouette_of_box(const cv::Rect& object) {
  Silhouette s;
  s.projection = {.width = 800, .height = 600, .fx = 1234.5, .fy = 1233.25, .cx = 401.375, .cy = 299.8125};
  cv::Mat1f field(600, 800, 1.0F);
  field(object) = -1.0F;
  s.outside_px = contour_distance(field);
  return s;
}

/// A box in front of a whole background.
View view_of_box() {
  View view;
  view.silhouettes = {silhouette_of_box(kLeftObject), silhouette_of_box(kRightObject)};
  RangeImage& range = view.range;
  range.projection = view.silhouettes.front().projection;
  range.depth = cv::Mat1f(600, 800, kUnmeasured);
  range.sigma = range.depth.clone();
  range.normal = cv::Mat3f(600, 800, cv::Vec3f::all(kUnmeasured));
  range.background = cv::Mat1b(600, 800, uchar{255});
  range.background(kLeftObject) = 0;
  for (int y = kLeftObject.y; y < kLeftObject.br().y; ++y) {
    for (int x = kLeftObject.x; x < kLeftObject.br().x; ++x) {
      range.depth(y, x) = 400.0F + 0.01F * static_cast<float>(x + 3 * y);
      range.sigma(y, x) = 0.01F;
      range.normal(y, x) = {0, 0, -1};
    }
  }
  return view;
}

/// Of pixels as of the bits of their points in space.
void expect_same_surface(const RangeImage& part, const RangeImage& whole) {
  const Projection& p = part.projection;
  for (int y = 0; y < whole.depth.rows; ++y) {
    for (int x = 0; x < whole.depth.cols; ++x) {
      const int u = x - p.crop_x, v = y - p.crop_y;
      if (!cv::Point(u, v).inside({0, 0, p.width, p.height})) {
        EXPECT_TRUE(std::isnan(whole.depth(y, x)) && whole.background(y, x) == 255) << x << " " << y;
        continue;
      }
      EXPECT_EQ(part.background(v, u), whole.background(y, x));
      if (std::isnan(whole.depth(y, x))) {
        EXPECT_TRUE(std::isnan(part.depth(v, u)));
        continue;
      }
      EXPECT_EQ(p.unproject(u, v, static_cast<double>(part.depth(v, u))),
                whole.projection.unproject(x, y, static_cast<double>(whole.depth(y, x))));
      EXPECT_EQ(part.sigma(v, u), whole.sigma(y, x));
      EXPECT_EQ(part.normal(v, u), whole.normal(y, x));
    }
  }
}

TEST(CropView, KeepsTheObjectWithRoomAroundItAndNothingElse) {
  const View whole = view_of_box();
  View view = view_of_box();
  crop_to_object(view);
  expect_same_surface(view.range, whole.range);
  for (const auto& [s, object] : {std::pair{view.silhouettes[0], kLeftObject}, {view.silhouettes[1], kRightObject}}) {
    const Projection& p = s.projection;
    const cv::Rect kept(p.crop_x, p.crop_y, p.width, p.height);
    EXPECT_EQ(kept & object, object);
    EXPECT_EQ(s.outside_px.size(), kept.size());
    EXPECT_EQ(kept.x % kCropAlignPx, 0);
    EXPECT_EQ(kept.y % kCropAlignPx, 0);
    EXPECT_GE(object.x - kept.x, kCropRoomPx);
    EXPECT_LT(kept.area(), 4 * object.area());
    EXPECT_EQ(p.sensor_width, 800);
    EXPECT_EQ(p.sensor_height, 600);
  }
}

TEST(CropView, TellsCroppedOffPixelsFromThoseBesideTheSensor) {
  View view = view_of_box();
  EXPECT_FALSE(view.range.projection.is_cropped_off({-1.0, 5.0})) << "not cropped";
  crop_to_object(view);
  const Projection& p = view.range.projection;
  const auto at = [&](double x, double y) { return Eigen::Vector2d(x - p.crop_x, y - p.crop_y); };
  EXPECT_FALSE(p.is_cropped_off(at(340, 260)));
  EXPECT_TRUE(p.is_cropped_off(at(5, 5)));
  EXPECT_TRUE(p.is_cropped_off(at(799, 599)));
  EXPECT_FALSE(p.is_cropped_off(at(799, 599), 2.0));
  EXPECT_FALSE(p.is_cropped_off(at(-1, 300)));
  EXPECT_FALSE(p.is_cropped_off(at(800, 300)));
}

TEST(CropView, PixelsTakenInAgainAreBackground) {
  const View whole = view_of_box();
  View view = view_of_box();
  crop_to_object(view);
  const Projection before = view.range.projection;
  const cv::Rect right_before = cv::Rect({0, 0}, view.silhouettes[1].outside_px.size());
  const cv::Point far_point(700, 450);  // on the sensor
  uncrop(view, 0, {far_point.x - before.crop_x, far_point.y - before.crop_y, 1, 1});
  expect_same_surface(view.range, whole.range);
  const Silhouette& s = view.silhouettes.front();
  EXPECT_EQ(s.projection.crop_x, view.range.projection.crop_x);
  EXPECT_EQ(s.outside_px.size(), view.range.depth.size());
  EXPECT_LT(view.range.depth.cols, 800);
  const cv::Point here(far_point.x - s.projection.crop_x, far_point.y - s.projection.crop_y);
  ASSERT_TRUE(here.inside({0, 0, s.outside_px.cols - kCropRoomPx, s.outside_px.rows - kCropRoomPx}));
  EXPECT_NEAR(s.outside_px(here), whole.silhouettes.front().outside_px(far_point), 0.1 * s.outside_px(here));
  EXPECT_EQ(right_before.size(), view.silhouettes[1].outside_px.size());
}

TEST(CropView, PixelsTakenInAgainEndAtTheSensor) {
  View view = view_of_box();
  crop_to_object(view);
  const Projection before = view.silhouettes[1].projection;
  uncrop(view, 1, {799 - before.crop_x, -before.crop_y, 1, 1});
  const Projection& p = view.silhouettes[1].projection;
  EXPECT_EQ(p.crop_y, 0);
  EXPECT_EQ(p.crop_x + p.width, 800);
  EXPECT_EQ(view.range.projection.crop_x, view.silhouettes[0].projection.crop_x) << "the left camera stays";
}

TEST(CropView, AViewWithoutAWholeBackgroundStaysWhole) {
  View view = view_of_box();
  view.range.background_is_whole = false;
  crop_to_object(view);
  EXPECT_FALSE(view.range.projection.is_cropped());
  EXPECT_EQ(view.range.depth.cols, 800);
  View grey = view_of_box();
  grey.silhouettes.clear();
  crop_to_object(grey);
  EXPECT_EQ(grey.range.depth.cols, 800);
}

}  // namespace
}  // namespace scanrig
