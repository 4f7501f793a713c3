#include "sim/scene/image_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

namespace scanrig::sim {
namespace {

/// Profile 2's sensor with one effect, or all of them, and no vignetting.
ImageSensor sensor_with(std::initializer_list<std::string_view> names, bool is_left = true, PixelCoding coding = {}) {
  Effects effects;
  effects.vignetting = 0.0;
  for (const Effect& effect : workshop_effects()) {
    for (const auto name : names) {
      if (effect.name != name) continue;
      for (const auto& size : effect.sizes) effects.*size.member = size.value;
    }
  }
  return ImageSensor(effects, is_left, coding);
}

cv::Mat even_light(double grey, int width = 400, int height = 300) {
  return cv::Mat(height, width, CV_32F, cv::Scalar(grey / 255.0));
}

/// Mean over many exposures, as a person would characterise a camera.
cv::Mat mean_image(const ImageSensor& sensor, const cv::Mat& light, int exposures) {
  cv::Mat sum(light.size(), CV_64F, cv::Scalar(0));
  for (int i = 1; i <= exposures; ++i) {
    cv::Mat one;
    sensor.expose(light, static_cast<std::uint64_t>(i)).convertTo(one, CV_64F);
    sum += one;
  }
  return sum / exposures;
}

double deviation(const cv::Mat& image) {
  cv::Scalar mean, sigma;
  cv::meanStdDev(image, mean, sigma);
  return sigma[0];
}

TEST(ImageSensor, HasTheNoiseOfItsPhotons) {
  // Photon transfer: variance of the difference of two images against the mean. Slope and dark noise are the profile's.
  const ImageSensor sensor = sensor_with({"prnu", "columns", "gain"});
  std::vector<double> mean, variance;
  for (const double grey : {40.0, 80.0, 120.0, 160.0, 200.0}) {
    cv::Mat a, b;
    sensor.expose(even_light(grey), 5).convertTo(a, CV_64F);
    sensor.expose(even_light(grey), 6).convertTo(b, CV_64F);
    mean.push_back(0.5 * (cv::mean(a)[0] + cv::mean(b)[0]));
    variance.push_back(0.5 * std::pow(deviation(a - b), 2.0) - 1.0 / 12.0);
  }
  const double slope = (variance.back() - variance.front()) / (mean.back() - mean.front());
  EXPECT_NEAR(slope, 0.0263, 0.0012);
  EXPECT_NEAR(variance.front() - slope * mean.front(), 0.64, 0.1);
}

TEST(ImageSensor, GainsDifferFromCameraToCameraAndPixelToPixel) {
  const double left = cv::mean(sensor_with({"gain"}).expose(even_light(150), 0))[0],
               right = cv::mean(sensor_with({"gain"}, false).expose(even_light(150), 0))[0];
  EXPECT_NEAR(left / right, 1.02 / 0.98, 0.004);
  const cv::Mat mean = mean_image(sensor_with({"prnu"}), even_light(180, 120, 90), 60);
  const double noise = std::sqrt((0.64 + 0.0263 * 180.0 + 1.0 / 12.0) / 60.0);
  EXPECT_NEAR(std::sqrt(std::pow(deviation(mean), 2.0) - noise * noise) / 180.0, 0.008, 0.0006);
  EXPECT_EQ(deviation(sensor_with({}).expose(even_light(180), 0)), 0.0);
}

TEST(ImageSensor, HasOffsetsOfItsColumns) {
  const cv::Mat mean = mean_image(sensor_with({"columns"}), even_light(100, 300, 200), 20);
  cv::Mat columns;
  cv::reduce(mean, columns, 0, cv::REDUCE_AVG);
  EXPECT_NEAR(deviation(columns), 0.3, 0.05);
  // Each its own.
  EXPECT_NEAR(deviation(columns.colRange(1, 300) - columns.colRange(0, 299)), 0.3 * std::sqrt(2.0), 0.07);
  cv::Mat rows;
  cv::reduce(mean, rows, 1, cv::REDUCE_AVG);
  EXPECT_LT(deviation(rows), 0.05);
}

TEST(ImageSensor, HasOneHotPixelInTwentyThousand) {
  const cv::Mat dark = sensor_with({"hot-pixels"}).expose(even_light(0, 1280, 960), 0);
  EXPECT_NEAR(cv::countNonZero(dark > 20), 1280.0 * 960.0 / 20000.0, 24.0);  // three sigma
  const cv::Mat again = sensor_with({"hot-pixels"}).expose(even_light(0, 1280, 960), 0);
  EXPECT_EQ(cv::norm(dark, again, cv::NORM_INF), 0.0);
}

TEST(ImageSensor, DriftsInItsBlackLevel) {
  const ImageSensor sensor = sensor_with({"black-level"});
  double lowest = 255.0, highest = 0.0;
  for (std::uint64_t exposure = 1; exposure <= 40; ++exposure) {
    const double black = cv::mean(sensor.expose(even_light(10), exposure))[0] - 10.0;
    lowest = std::min(lowest, black), highest = std::max(highest, black);
  }
  EXPECT_NEAR(0.5 * (lowest + highest), 2.0, 0.15);
  EXPECT_NEAR(highest - lowest, 0.8, 0.15);
}

TEST(ImageSensor, MixesNeighbouringPixels) {
  cv::Mat light(41, 41, CV_32F, cv::Scalar(0));
  light.at<float>(20, 20) = 200.0F / 255.0F;
  const cv::Mat raw = sensor_with({"cross-talk"}).expose(light, 0);
  EXPECT_EQ(raw.at<std::uint8_t>(20, 20), 188);  // 6 % less
  EXPECT_EQ(raw.at<std::uint8_t>(20, 21), 3);
  EXPECT_EQ(raw.at<std::uint8_t>(19, 20), 3);
  EXPECT_EQ(raw.at<std::uint8_t>(21, 21), 0);
}

TEST(ImageSensor, VignettesOffItsCentre) {
  Effects effects;
  for (const Effect& effect : workshop_effects()) {
    if (effect.name == "vignetting")
      for (const auto& size : effect.sizes) effects.*size.member = size.value;
  }
  const cv::Mat raw = ImageSensor(effects).expose(even_light(200, 1280, 960), 0);
  const int right = raw.at<std::uint8_t>(480, 1279), left = raw.at<std::uint8_t>(480, 0);
  EXPECT_GT(right, left + 4);
  EXPECT_GT(raw.at<std::uint8_t>(0, 640), raw.at<std::uint8_t>(959, 640) + 1);
  EXPECT_EQ(raw.at<std::uint8_t>(450, 700), 200);
  EXPECT_NEAR(raw.at<std::uint8_t>(959, 0), 200 * (1.0 - 0.15 * 1.15),
              3);  // farther than the corner is from the middle
}

TEST(ImageSensor, WritesTwelveBitsAndGammaWhereAsked) {
  const cv::Mat fine = sensor_with({}, true, {.bits = 12}).expose(even_light(100.25), 0);
  ASSERT_EQ(fine.type(), CV_16U);
  EXPECT_EQ(fine.at<std::uint16_t>(3, 3), std::lround(100.25 / 255.0 * 4095.0));
  const cv::Mat coded = sensor_with({}, true, {.gamma = 0.45}).expose(even_light(64), 0);
  EXPECT_EQ(coded.at<std::uint8_t>(3, 3), std::lround(255.0 * std::pow(64.0 / 255.0, 0.45)));
}

}  // namespace
}  // namespace scanrig::sim
