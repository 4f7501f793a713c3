#include "pipeline/storage/images.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using namespace scan_samples;

/// Sensor image of a scene of one colour: red at (0,0), green at (0,1) and (1,0), blue at (1,1).
cv::Mat1b through_colour_filter(int red, int green, int blue) {
  cv::Mat1b image(48, 64);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      image(r, c) = static_cast<uchar>(r % 2 == 0 && c % 2 == 0 ? red : r % 2 == 1 && c % 2 == 1 ? blue : green);
    }
  }
  return image;
}

TEST(ToViewImages, ColoursSurviveTheBayerFilter) {
  RawView raw{"BayerRG8", {}, {}, {}, {}};
  raw.left_pattern = through_colour_filter(200, 100, 30);
  raw.right_pattern = through_colour_filter(10, 20, 250);
  raw.left_plain = through_colour_filter(0, 255, 0);
  raw.right_plain = through_colour_filter(255, 0, 0);
  const auto images = to_view_images(raw, {});
  ASSERT_TRUE(images) << images.error().message;
  for (const cv::Point p : {cv::Point(20, 20), cv::Point(21, 20), cv::Point(20, 21), cv::Point(21, 21)}) {
    EXPECT_EQ(images->left_pattern.at<cv::Vec3b>(p), cv::Vec3b(30, 100, 200));
    EXPECT_EQ(images->right_pattern.at<cv::Vec3b>(p), cv::Vec3b(250, 20, 10));
    EXPECT_EQ(images->left_plain.at<cv::Vec3b>(p), cv::Vec3b(0, 255, 0));
    EXPECT_EQ(images->right_plain.at<cv::Vec3b>(p), cv::Vec3b(0, 0, 255));
  }
}

// A vertical edge of grey: green at red and blue pixels is taken along it, so no colour appears beside it.
TEST(ToViewImages, AnEdgeStaysSharpAndGreyInGreen) {
  RawView raw = raw_view(0);
  raw.left_plain = cv::Mat1b(48, 64, uchar{20});
  raw.left_plain.colRange(32, 64) = 220;
  const auto images = to_view_images(raw, {});
  ASSERT_TRUE(images);
  for (const int row : {20, 21}) {
    EXPECT_EQ(images->left_plain.at<cv::Vec3b>(row, 31)[1], 20);
    EXPECT_EQ(images->left_plain.at<cv::Vec3b>(row, 32)[1], 220);
  }
}

TEST(ToUsableImage, IsTheSameAsInAView) {
  const RawView raw = raw_view(0);
  EXPECT_TRUE(same(*to_usable_image(raw.left_plain, raw.pixel_format), to_view_images(raw, {})->left_plain));
  EXPECT_TRUE(same(*to_usable_image(raw.left_plain, "Mono8"), raw.left_plain));
  EXPECT_EQ(to_usable_image({}, "Mono8").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(to_usable_image(raw.left_plain, "BGR8").error().code, ErrorCode::invalid_input);
}

TEST(ToViewImages, GreyAndColourPassThrough) {
  RawView raw = raw_view(0);
  raw.pixel_format = "Mono8";
  EXPECT_TRUE(same(to_view_images(raw, {})->right_plain, raw.right_plain));
  raw.pixel_format = "YUV422";
  EXPECT_EQ(to_view_images(raw, {}).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
