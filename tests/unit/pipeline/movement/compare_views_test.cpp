#include "pipeline/movement/compare_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

const cv::Size kSize(320, 240);

/// A painted object before an even background, moved by `shift` pixels; the background stays.
cv::Mat scene(std::uint64_t object, cv::Point2d shift = {}, std::uint64_t noise = 1) {
  cv::RNG paint(object);
  cv::Mat1f coarse(30, 30);
  paint.fill(coarse, cv::RNG::UNIFORM, 60, 220);
  cv::Mat1f texture;
  cv::resize(coarse, texture, {160, 160}, 0, 0, cv::INTER_CUBIC);
  cv::Mat1f unmoved(kSize, 40.0f), image;
  texture.copyTo(unmoved(cv::Rect(80, 40, 160, 160)));
  const cv::Mat place = (cv::Mat_<double>(2, 3) << 1, 0, shift.x, 0, 1, shift.y);
  cv::warpAffine(unmoved, image, place, kSize, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::Mat1f sensor(kSize);
  cv::RNG(noise).fill(sensor, cv::RNG::NORMAL, 0, 1.5);
  cv::Mat result;
  cv::Mat(image + sensor).convertTo(result, CV_8U);
  return result;
}

ViewChange compare(const cv::Mat& before, const cv::Mat& after) {
  const auto change = compare_views(before, after);
  EXPECT_TRUE(change) << change.error().message;
  return change.value_or(ViewChange{});
}

TEST(CompareViews, TheSameSceneUnderNewNoiseIsUnmoved) {
  const auto change = compare(scene(1), scene(1, {}, 2));
  EXPECT_TRUE(change.unmoved);
  EXPECT_GT(change.squares, 20);
  EXPECT_LT(change.shift_px, 0.1);
}

TEST(CompareViews, ARepeatedAngleThatIsOffByAnEighthOfAPixelIsUnmoved) {
  const auto change = compare(scene(1), scene(1, {0.1, 0.08}, 2));
  EXPECT_NEAR(change.shift_px, 0.13, 0.1) << "with its noise";
  EXPECT_EQ(change.changed, 0.0);
  EXPECT_TRUE(change.unmoved);
}

TEST(CompareViews, ASlippedObjectIsMeasuredUpToAPixel) {
  for (const cv::Point2d shift : {cv::Point2d(0.3, 0), cv::Point2d(0, -0.5), cv::Point2d(0.6, 0.6)}) {
    const auto change = compare(scene(1), scene(1, shift, 2));
    EXPECT_FALSE(change.unmoved);
    EXPECT_NEAR(change.shift_px, std::hypot(shift.x, shift.y), 0.1);
  }
}

/// Stripes that rise to the right in the upper half and fall in the lower, moved by `shift` pixels to the right: each
/// square shows only the shift across its own stripes.
cv::Mat stripes(double shift, std::uint64_t noise) {
  cv::Mat1f image(1920, 240);  // so high that few squares see both
  cv::RNG(noise).fill(image, cv::RNG::NORMAL, 120, 1.5);
  for (int y = 0; y < image.rows; ++y) {
    const double slope = y < image.rows / 2 ? 1.0 : -1.0;
    for (int x = 0; x < image.cols; ++x) image(y, x) += static_cast<float>(60 * std::sin((x - shift + slope * y) / 4));
  }
  cv::Mat result;
  image.convertTo(result, CV_8U);
  return result;
}

TEST(CompareViews, AShiftThatNoSingleSquareShowsIsFoundInAllTogether) {
  const auto change = compare(stripes(0.0, 1), stripes(0.3, 2));
  EXPECT_NEAR(change.shift_px, 0.3, 0.02);
  EXPECT_FALSE(change.unmoved);
}

TEST(CompareViews, ALargerMovementIsFoundToo) {
  for (const double shift : {1.5, 3.0, 6.0, 20.0, 60.0}) {
    EXPECT_FALSE(compare(scene(1), scene(1, {shift, 0}, 2)).unmoved) << shift;
  }
}

TEST(CompareViews, DimmerLightIsNoMovement) {
  const auto change = compare(scene(1), scene(1, {}, 2) * 0.9);
  EXPECT_TRUE(change.unmoved) << change.shift_px << " " << change.changed;
}

TEST(CompareViews, AnotherObjectIsNotTheSame) { EXPECT_FALSE(compare(scene(1), scene(7)).unmoved); }

TEST(CompareViews, AnEmptyTableIsNotTheSame) {
  const cv::Mat empty(kSize, CV_8UC1, cv::Scalar(40));
  EXPECT_FALSE(compare(scene(1), empty).unmoved);
  EXPECT_FALSE(compare(empty, scene(1)).unmoved);
}

TEST(CompareViews, ImagesWithoutFeaturesAreComparedByTheirLight) {
  const cv::Mat dark(kSize, CV_8UC1, cv::Scalar(40)), alike(kSize, CV_8UC1, cv::Scalar(42));
  EXPECT_TRUE(compare(dark, alike).unmoved);
  EXPECT_FALSE(compare(dark, cv::Mat(kSize, CV_8UC1, cv::Scalar(60))).unmoved);
}

TEST(CompareViews, ColourWorksToo) {
  cv::Mat before, after;
  cv::cvtColor(scene(1), before, cv::COLOR_GRAY2BGR);
  cv::cvtColor(scene(1, {2, 0}, 2), after, cv::COLOR_GRAY2BGR);
  EXPECT_TRUE(compare(before, before).unmoved);
  EXPECT_FALSE(compare(before, after).unmoved);
}

TEST(CompareViews, ImagesOfDifferentSizeOrTypeAreRefused) {
  const cv::Mat small(10, 10, CV_8UC1, cv::Scalar(0)), deep(kSize, CV_16UC1, cv::Scalar(0));
  EXPECT_EQ(compare_views(scene(1), small).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(compare_views(deep, deep).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(compare_views(scene(1), cv::Mat(kSize, CV_8UC3)).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(compare_views({}, {}).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
