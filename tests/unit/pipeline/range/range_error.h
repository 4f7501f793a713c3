#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pipeline/range/range_image.h"

namespace scanrig::test {

/// Errors over the true pixels in `region`, and over pixels measured outside the surface.
struct RangeError {
  double median = 0.0, p95 = 0.0, bias = 0.0;  ///< mm of depth
  double gross = 0.0;        ///< share of measured pixels more than 0.25 mm off, or outside the surface
  double coverage = 0.0;     ///< share of true pixels measured
  double sigma_ratio = 0.0;  ///< median |error / sigma| over that of a normal distribution
};

inline RangeError compare(const RangeImage& range, const cv::Mat1f& truth, const cv::Mat1b& region) {
  std::vector<double> errors, ratios;
  RangeError c;
  double wanted = 0.0, covered = 0.0;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const bool measured = std::isfinite(range.depth(v, u));
      if (region(v, u) == 0 && std::isfinite(truth(v, u))) continue;
      if (std::isfinite(truth(v, u))) {
        wanted += 1.0;
        covered += measured ? 1.0 : 0.0;
      }
      if (!measured) continue;
      const double error = std::isfinite(truth(v, u)) ? double(range.depth(v, u)) - double(truth(v, u)) : 1e3;
      if (std::abs(error) > 0.25) c.gross += 1.0;
      c.bias += error;
      errors.push_back(std::abs(error));
      ratios.push_back(std::abs(error) / double(range.sigma(v, u)));
    }
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (errors.empty()) return {nan, nan, nan, nan, 0.0, nan};
  std::sort(errors.begin(), errors.end());
  std::sort(ratios.begin(), ratios.end());
  const double count = static_cast<double>(errors.size());
  c.median = errors[errors.size() / 2];
  c.p95 = errors[errors.size() * 95 / 100];
  c.bias /= count;
  c.gross /= count;
  c.coverage = covered / wanted;
  c.sigma_ratio = ratios[ratios.size() / 2] / 0.6745;
  return c;
}

}  // namespace scanrig::test
