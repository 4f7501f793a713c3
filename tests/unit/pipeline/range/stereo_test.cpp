#include "pipeline/range/stereo.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/parallel.h"
#include "tests/unit/pipeline/range/two_cameras.h"

namespace scanrig {
namespace {

using test::Surface;

struct Comparison {
  double median = 0.0, p95 = 0.0, p99 = 0.0, bias = 0.0;  // mm
  double gross = 0.0;     // share of measured pixels more than 0.25 mm off
  double coverage = 0.0;  // share of true pixels (incidence < 65 deg) measured
  double sigma_ratio = 0.0;  // median |error / sigma| * 1.48
};

Comparison compare(const RangeImage& range, const cv::Mat1f& truth) {
  std::vector<double> errors, ratios;
  double sum = 0.0, seen = 0.0, measured = 0.0, gross = 0.0;
  for (int v = 1; v + 1 < truth.rows; ++v) {
    for (int u = 1; u + 1 < truth.cols; ++u) {
      const double z = truth(v, u);
      const double slope = std::max(std::abs(double(truth(v, u + 1)) - truth(v, u - 1)), std::abs(double(truth(v + 1, u)) - truth(v - 1, u)));
      if (slope < 2 * 2.1 * z / 4266.7) {
        ++seen;
        measured += std::isfinite(range.depth(v, u)) ? 1 : 0;
      }
      if (!std::isfinite(range.depth(v, u))) continue;
      if (!std::isfinite(z)) {
        ++gross;
        errors.push_back(1.0);
        continue;
      }
      const double error = double(range.depth(v, u)) - z;
      sum += error;
      errors.push_back(std::abs(error));
      ratios.push_back(std::abs(error) / double(range.sigma(v, u)));
      if (std::abs(error) > 0.25) ++gross;
    }
  }
  std::sort(errors.begin(), errors.end());
  std::sort(ratios.begin(), ratios.end());
  const auto at = [&](double q) { return errors.empty() ? NAN : errors[std::size_t(q * double(errors.size() - 1))]; };
  return {at(0.5), at(0.95), at(0.99), sum / double(errors.size()), gross / double(errors.size()), measured / seen,
          ratios.empty() ? NAN : 1.48 * ratios[ratios.size() / 2]};
}

TEST(Stereo, Try) {
  const Calibration calibration = test::default_rig({640, 480});
  const Surface surface = test::nearest_of(test::ball({0, 45, 0}, 25), test::ball({0, 65, 22}, 6));
  test::Look look;
  const cv::Mat3b left = test::render(calibration.left, surface, look);
  look.seed = 2;
  const cv::Mat3b right = test::render(calibration.right, surface, look);
  const auto rectification = rectify(calibration);
  ASSERT_TRUE(rectification) << rectification.error().message;
  printf("disparities %d %d\n", rectification->min_disparity, rectification->max_disparity);
  const cv::Mat1f truth = test::true_depth(rectification->left, rectification->left_from_turntable, surface);
  const cv::Mat1b mask = truth == truth;
  const auto t0 = std::chrono::steady_clock::now();
  const auto range = match_stereo(*rectification, left, right, mask, {}, {}, {});
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count();
  ASSERT_TRUE(range) << range.error().message;
  const Comparison c = compare(*range, truth);
  printf("pixels %d: median %.4f p95 %.4f p99 %.4f bias %.4f gross %.4f%% coverage %.4f sigma %.2f, %.2f s\n", cv::countNonZero(mask), c.median, c.p95, c.p99,
         c.bias, 100 * c.gross, c.coverage, c.sigma_ratio, s);
  cv::imwrite("/tmp/range_left.png", left);
  cv::Mat1b picture = (range->depth - truth) * 1000 + 128;
  picture.setTo(0, range->depth != range->depth);
  cv::imwrite("/tmp/range_error.png", picture);
}

}  // namespace
}  // namespace scanrig
