#include "drivers/camera/image_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace scanrig {
namespace {

/// Independent grains seen through a lens that blurs by `sigma` pixels.
cv::Mat grains(double sigma) {
  cv::Mat image(240, 320, CV_32F);
  cv::RNG random(7);
  random.fill(image, cv::RNG::NORMAL, 128.0, 30.0 * (1.0 + 3.0 * sigma));
  cv::GaussianBlur(image, image, {}, sigma);
  cv::Mat bytes;
  image.convertTo(bytes, CV_8U);
  return bytes;
}

TEST(ImageQuality, BlurIsThatOfTheLens) {
  for (const double sigma : {1.0, 1.5, 2.0, 3.0}) {
    EXPECT_NEAR(measure(grains(sigma), PixelFormat::mono8).blur_px, sigma, 0.12 * sigma) << sigma;
  }
}

TEST(ImageQuality, BlurDoesNotDependOnTheLight) {
  const cv::Mat bright = grains(2.0);
  const cv::Mat dim = bright / 3;
  EXPECT_NEAR(measure(bright, PixelFormat::mono8).blur_px, measure(dim, PixelFormat::mono8).blur_px, 0.15);
}

TEST(ImageQuality, TheMosaicOfAColouredSensorIsNotTakenForTexture) {
  cv::Mat mosaic = grains(3.0);
  for (int y = 0; y < mosaic.rows; y += 2) {
    for (int x = 0; x < mosaic.cols; x += 2) {
      mosaic.at<std::uint8_t>(y, x) /= 4;
      mosaic.at<std::uint8_t>(y + 1, x + 1) /= 2;
    }
  }
  EXPECT_NEAR(measure(mosaic, PixelFormat::bayer_rggb8).blur_px, 3.0, 0.6);
}

TEST(ImageQuality, SaturationIsTheShareOfFullPixels) {
  cv::Mat image(10, 10, CV_8U, cv::Scalar(254));
  EXPECT_EQ(measure(image, PixelFormat::mono8).saturated, 0.0);
  image.row(3).setTo(255);
  EXPECT_DOUBLE_EQ(measure(image, PixelFormat::mono8).saturated, 0.1);
}

TEST(ImageQuality, BrightnessIsTheMeanOfTheScale) {
  const cv::Mat colour(4, 4, CV_8UC3, cv::Scalar(0, 51, 102));
  EXPECT_NEAR(measure(colour, PixelFormat::bgr8).brightness, 0.2, 1e-12);
}

TEST(ImageQuality, OnePictureOnBothSidesIsAlikeDespiteNoiseAndTwoViewpointsAreNot) {
  const cv::Mat left = grains(1.2);
  cv::Mat noise(left.size(), CV_8U), other;
  cv::RNG(3).fill(noise, cv::RNG::NORMAL, 0.0, 6.0);
  EXPECT_GT(left_right_correlation(left, left + noise, PixelFormat::mono8), 0.5);
  cv::Mat shifted = cv::Mat::zeros(left.size(), CV_8U);
  left.colRange(7, left.cols).copyTo(shifted.colRange(0, left.cols - 7));
  EXPECT_LT(left_right_correlation(left, shifted, PixelFormat::mono8), 0.15);
}

TEST(ImageQuality, AMarkInTheCornerOfBothImagesDoesNotMakeThemAlike) {
  cv::Mat left = grains(1.2), right = left.clone();
  cv::flip(right, right, 1);
  for (cv::Mat* image : {&left, &right}) {
    for (int x = 0; x < 24; x += 6) (*image)(cv::Rect(x, 0, 3, 12)).setTo(255);
  }
  EXPECT_LT(left_right_correlation(left, right, PixelFormat::mono8), 0.15);
}

TEST(ImageQuality, ImagesOfTwoKindsCannotBeCompared) {
  EXPECT_TRUE(std::isnan(left_right_correlation(grains(1.0), cv::Mat(8, 8, CV_8U), PixelFormat::mono8)));
  EXPECT_TRUE(std::isnan(left_right_correlation(cv::Mat(8, 8, CV_8U, cv::Scalar(9)),
                                                cv::Mat(8, 8, CV_8U, cv::Scalar(9)), PixelFormat::mono8)));
}

TEST(ImageQuality, AnImageWithoutTextureHasNoBlur) {
  EXPECT_TRUE(std::isnan(measure(cv::Mat(8, 8, CV_8U, cv::Scalar(9)), PixelFormat::mono8).blur_px));
  EXPECT_TRUE(std::isnan(measure({}, PixelFormat::mono8).brightness));
}

TEST(Texture, OfIndependentPixelsIsTheirStandardDeviation) {
  cv::Mat noise(240, 320, CV_8U);
  cv::RNG(3).fill(noise, cv::RNG::NORMAL, 128.0, 10.0);
  EXPECT_NEAR(texture(noise, PixelFormat::mono8), 10.0 / 255.0, 0.002);
  EXPECT_NEAR(texture(noise / 2, PixelFormat::mono8), 5.0 / 255.0, 0.002);
}

TEST(Texture, LeavesShadingAndTheMosaicOut) {
  cv::Mat mosaic(240, 320, CV_8U);
  for (int y = 0; y < mosaic.rows; ++y) {
    for (int x = 0; x < mosaic.cols; ++x) {
      mosaic.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>((x / 4 + y / 4) / (1 + (x & 1)));
    }
  }
  EXPECT_LT(texture(mosaic, PixelFormat::bayer_rggb8), 0.002);
  EXPECT_GT(texture(mosaic, PixelFormat::mono8), 0.02);
  EXPECT_EQ(texture({}, PixelFormat::mono8), 0.0);
}

}  // namespace
}  // namespace scanrig
