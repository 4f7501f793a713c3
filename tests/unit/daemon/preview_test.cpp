#include "daemon/rig/preview.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/virtual_clock.h"

namespace scanrig {
namespace {

class PreviewTest : public testing::Test {
 protected:
  PreviewTest() {
    preview_.on_wanted([this] { ++looks_; });
  }
  static StereoFrame pair(int left, int right) {
    StereoFrame frame;
    frame.left = cv::Mat(48, 64, CV_8UC1, cv::Scalar(left));
    frame.right = cv::Mat(48, 64, CV_8UC1, cv::Scalar(right));
    return frame;
  }
  /// The grey value of the image's middle; -1 without an image.
  int grey(Side side) {
    const auto jpeg = preview_.jpeg(side);
    if (!jpeg) return -1;
    const cv::Mat image = cv::imdecode(std::vector<char>(jpeg->begin(), jpeg->end()), cv::IMREAD_GRAYSCALE);
    return image.size() == cv::Size(64, 48) ? image.at<std::uint8_t>(24, 32) : -2;
  }
  void expect_error(ErrorCode code) {
    const auto jpeg = preview_.jpeg(Side::left);
    ASSERT_FALSE(jpeg);
    EXPECT_EQ(jpeg.error().code, code) << jpeg.error().message;
  }

  VirtualClock clock_;
  bool quiet_ = true;
  int looks_ = 0;
  Preview preview_{clock_, [this] { return quiet_; }};
};

TEST_F(PreviewTest, TheFirstToAskMakesTheCamerasLook) {
  expect_error(ErrorCode::not_found);
  expect_error(ErrorCode::not_found);
  EXPECT_EQ(looks_, 1) << "one look at a time";
  preview_.keep(pair(40, 90));
  EXPECT_NEAR(grey(Side::left), 40, 2);
  EXPECT_EQ(looks_, 2) << "and the next one is on its way";
  EXPECT_NEAR(grey(Side::right), 90, 2);
  EXPECT_EQ(looks_, 2);
}

TEST_F(PreviewTest, DuringAScanItsPicturesAreShownAndNobodyLooks) {
  quiet_ = false;
  expect_error(ErrorCode::not_found);
  preview_.keep(pair(40, 90));
  EXPECT_NEAR(grey(Side::left), 40, 2);
  preview_.keep(pair(70, 90));
  EXPECT_NEAR(grey(Side::left), 70, 2);
  EXPECT_EQ(looks_, 0);
}

TEST_F(PreviewTest, CamerasThatDoNotAnswerAreTold) {
  preview_.keep(pair(40, 90));
  EXPECT_NEAR(grey(Side::left), 40, 2);
  preview_.failed({ErrorCode::io, "left camera 4711: no answer"});
  expect_error(ErrorCode::io);
  EXPECT_EQ(looks_, 1) << "not again at once";
  clock_.sleep_for(std::chrono::seconds(3));
  expect_error(ErrorCode::io);
  EXPECT_EQ(looks_, 2);
  preview_.keep(pair(60, 90));
  EXPECT_NEAR(grey(Side::left), 60, 2);
}

TEST_F(PreviewTest, TheMiddleIsShownInFullResolutionAndKeepsTheColoursOfTheSensor) {
  StereoFrame frame;
  frame.format = PixelFormat::bayer_rggb8;
  frame.left = cv::Mat(961, 1283, CV_8UC1, cv::Scalar(20));
  for (int v = 0; v < frame.left.rows; v += 2) {
    for (int u = 0; u < frame.left.cols; u += 2) frame.left.at<std::uint8_t>(v, u) = 220;  // red
  }
  frame.right = frame.left(cv::Rect(0, 0, 300, 200)).clone();
  preview_.keep(frame);
  const auto middle = [&](Side side) {
    const auto jpeg = preview_.jpeg(side, Extent::middle).value_or("");
    return cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), cv::IMREAD_COLOR);
  };
  const cv::Mat left = middle(Side::left);
  EXPECT_EQ(left.size(), cv::Size(512, 512));
  const auto colour = left.at<cv::Vec3b>(256, 256);
  EXPECT_GT(colour[2], 180) << "red";
  EXPECT_LT(colour[0], 60) << "no blue";
  EXPECT_EQ(middle(Side::right).size(), cv::Size(300, 200)) << "a small image is shown whole";
  const auto whole = preview_.jpeg(Side::left).value_or("");
  EXPECT_EQ(cv::imdecode(std::vector<char>(whole.begin(), whole.end()), cv::IMREAD_COLOR).cols, 1283);
}

TEST_F(PreviewTest, WhereOnlyAnEdgeExposesTheLatestExposureStays) {
  preview_.failed({ErrorCode::unsupported, "left camera: edges only"});
  expect_error(ErrorCode::unsupported);
  preview_.keep(pair(40, 90));
  preview_.failed({ErrorCode::unsupported, "left camera: edges only"});
  EXPECT_NEAR(grey(Side::left), 40, 2);
}

TEST_F(PreviewTest, AMosaicIsShownInColour) {
  StereoFrame frame = pair(0, 0);
  frame.format = PixelFormat::bayer_rggb8;
  for (int y = 0; y < 48; y += 2) {
    for (int x = 0; x < 64; x += 2) frame.left.at<std::uint8_t>(y, x) = 200;
  }
  preview_.keep(frame);
  const auto jpeg = preview_.jpeg(Side::left);
  ASSERT_TRUE(jpeg);
  const cv::Mat image = cv::imdecode(std::vector<char>(jpeg->begin(), jpeg->end()), cv::IMREAD_COLOR);
  const auto& bgr = image.at<cv::Vec3b>(24, 32);
  EXPECT_GT(bgr[2], 150) << "red";
  EXPECT_LT(bgr[0], 60);
}

TEST_F(PreviewTest, AfterTheRigHasGoneNobodyIsAsked) {
  preview_.on_wanted(nullptr);
  expect_error(ErrorCode::not_found);
  EXPECT_EQ(looks_, 0);
}

}  // namespace
}  // namespace scanrig
