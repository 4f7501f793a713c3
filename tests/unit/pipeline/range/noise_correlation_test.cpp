#include "pipeline/range/noise_correlation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/statistics.h"

namespace scanrig {
namespace {

const cv::Size kNoiseSize(400, 300);

/// A random pattern in two images without disparity, each with noise of its own, smoothed by `noise_px`.
struct Images {
  cv::Mat1f left, right;

  explicit Images(double noise_px) {
    cv::RNG random(3);
    cv::Mat1f pattern(kNoiseSize);
    random.fill(pattern, cv::RNG::NORMAL, 0.0, 100.0);
    cv::GaussianBlur(pattern, pattern, {}, 1.5);
    for (cv::Mat1f* image : {&left, &right}) {
      cv::Mat1f noise(kNoiseSize);
      random.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
      if (noise_px > 0.0) cv::GaussianBlur(noise, noise, {}, noise_px);
      *image = pattern + noise + 100.0;
    }
  }
};

struct Figures {
  float factor = 0.0F;
  double scatter = 0.0;  ///< rms error of the disparities by their sigma without the factor
};

Figures measure(double noise_px) {
  const Images images(noise_px);
  const MatchImage left(images.left), right(images.right);
  const MatchMask mask{cv::Mat1b(kNoiseSize, std::uint8_t{255}), cv::Mat1f(kNoiseSize, 0.0F)};
  std::vector<MatchedPixel> pixels;
  std::vector<double> errors;
  for (int v = 20; v < kNoiseSize.height - 20; v += 16) {
    for (int u = 20; u < kNoiseSize.width - 20; u += 16) {
      DisparityPatch start;
      start.radius = 7;
      const DisparityPatch patch = match_window(left, right, mask, u, v, start, {});
      if (!patch.valid) continue;
      pixels.push_back({{u, v}, patch});
      errors.push_back(static_cast<double>(patch.c[0] / patch.sigma));
    }
  }
  return {noise_correlation(left, right, mask, pixels, {}), root_mean_square(errors)};
}

TEST(NoiseCorrelation, OfWhiteNoiseIsOne) {
  const Figures white = measure(0.0);
  EXPECT_NEAR(white.factor, 1.0, 0.15);
  EXPECT_NEAR(white.scatter, 1.0, 0.2);
}

TEST(NoiseCorrelation, IsWhatCorrelatedNoiseAddsToTheScatterOfDisparities) {
  for (const double noise_px : {0.6, 1.0}) {
    const Figures smooth = measure(noise_px);
    EXPECT_GT(smooth.scatter, 1.3) << noise_px;
    EXPECT_NEAR(static_cast<double>(smooth.factor) / smooth.scatter, 1.0, 0.2) << noise_px;
  }
}

TEST(NoiseCorrelation, OfTooFewPixelsIsUnknown) {
  const Images images(0.0);
  const MatchImage left(images.left), right(images.right);
  const MatchMask mask{cv::Mat1b(kNoiseSize, std::uint8_t{255}), cv::Mat1f(kNoiseSize, 0.0F)};
  EXPECT_EQ(noise_correlation(left, right, mask, {}, {}), 0.0F);
}

}  // namespace
}  // namespace scanrig
