#include "pipeline/exposures/merge_exposures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace scanrig {
namespace {

constexpr int kSide = 256;

/// Light of pixel (x, y) in grey values of the first exposure: from 0 to `brightest`, dots on every level.
double light_at(int x, int y, double brightest) {
  const double level = brightest * std::pow(static_cast<double>(x) / (kSide - 1), 2.0);
  return (x + y) % 3 == 0 ? level : 0.3 * level;
}

/// A camera of 8 bit after EMVA 1288 with this noise.
cv::Mat taken(double brightest, double gain, double black, const NoiseModel& noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  cv::Mat image(kSide, kSide, CV_8UC1);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double light = gain * light_at(x, y, brightest);
      const double sigma = std::sqrt(noise.read_noise * noise.read_noise + noise.gain * light);
      const double grey = black + light + sigma * normal(random);
      image.at<uchar>(y, x) = static_cast<uchar>(std::lround(std::clamp(grey, 0.0, 255.0)));
    }
  }
  return image;
}

/// Root mean square error of the merged light where it is within [from, to], and its mean.
struct Error {
  double rms = 0.0, mean = 0.0;
};
Error error_of(const cv::Mat& merged, double brightest, double black, double from, double to) {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double light = light_at(x, y, brightest);
      if (light < from || light > to) continue;
      const double off = merged.at<ushort>(y, x) / static_cast<double>(kMergedUnitsPerGrey) - black - light;
      sum += off, squares += off * off, ++count;
    }
  }
  return {std::sqrt(squares / count), sum / count};
}

TEST(MergeExposures, ShowsDarkAndBrightLightAsItIs) {
  constexpr double kBlack = 2.0, kBrightest = 700.0;
  const NoiseModel noise{.black = kBlack};
  const cv::Mat first = taken(kBrightest, 1.0, kBlack, noise, 1);
  // Neither lasts quite as long as it should: flashes differ.
  const std::vector<OtherExposure> others{{taken(kBrightest, 8.3, kBlack, noise, 2), 8.0},
                                          {taken(kBrightest, 0.24, kBlack, noise, 3), 0.25}};
  const cv::Mat merged = merge_exposures(first, others, noise);
  ASSERT_EQ(merged.type(), CV_16UC1);

  const Error dark = error_of(merged, kBrightest, kBlack, 1.0, 20.0);
  EXPECT_LT(dark.rms, 0.3) << "a single exposure has 0.6 to 0.9";
  EXPECT_LT(std::abs(dark.mean), 0.1);
  const Error seam = error_of(merged, kBrightest, kBlack, 26.0, 34.0);
  EXPECT_LT(std::abs(seam.mean), 0.2) << "where the long exposure saturates";
  const Error bright = error_of(merged, kBrightest, kBlack, 260.0, 700.0);
  EXPECT_LT(bright.rms, 8.5) << "beyond the first exposure's full scale; photons alone make 7.4";
  EXPECT_LT(std::abs(bright.mean), 1.0);
}

TEST(MergeExposures, ASecondExposureOfTheSameDurationHalvesTheVariance) {
  const NoiseModel noise;
  const cv::Mat first = taken(150.0, 1.0, 1.0, noise, 1), again = taken(150.0, 1.02, 1.0, noise, 2);
  const std::vector<OtherExposure> others{{again, 1.001}};
  const double one = error_of(merge_exposures(first, {}, noise), 150.0, 1.0, 40.0, 150.0).rms,
               two = error_of(merge_exposures(first, others, noise), 150.0, 1.0, 40.0, 150.0).rms;
  EXPECT_NEAR(two / one, std::sqrt(0.5), 0.05);
}

TEST(MergeExposures, WithoutAnotherExposureNothingChanges) {
  const cv::Mat first = taken(300.0, 1.0, 2.0, {}, 1), merged = merge_exposures(first, {}, {});
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x)
      ASSERT_EQ(merged.at<ushort>(y, x), kMergedUnitsPerGrey * first.at<uchar>(y, x)) << x << ", " << y;
  }
}

TEST(MergeExposures, MeasuresTheLineBetweenExposuresOrTakesTheNominalOne) {
  const NoiseModel noise;
  const cv::Mat first = taken(200.0, 1.0, 3.0, noise, 1);
  const auto longer = line_between(first, {taken(200.0, 7.6, 3.0, noise, 2), 8.0}, 0.0);
  EXPECT_NEAR(longer.gain, 7.6, 0.05);
  EXPECT_NEAR(longer.offset, 3.0 * (1.0 - 7.6), 0.5);
  const auto shorter = line_between(first, {taken(200.0, 0.26, 3.0, noise, 3), 0.25}, 0.0);
  EXPECT_NEAR(shorter.gain, 0.26, 0.002);
  EXPECT_NEAR(shorter.offset, 3.0 * (1.0 - 0.26), 0.1);

  const cv::Mat night(kSide, kSide, CV_8UC1, cv::Scalar(3));
  const auto nominal = line_between(night, {night, 8.0}, 3.0);
  EXPECT_EQ(nominal.gain, 8.0);
  EXPECT_EQ(nominal.offset, -21.0);
}

}  // namespace
}  // namespace scanrig
