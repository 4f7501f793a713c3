#include "pipeline/calibration/lens_field.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace scanrig {
namespace {

/// Weights along one side of the image, `spans` long; returns the first coefficient.
int weigh(double at, int pixels, int spans, std::array<double, 4>& weight, std::array<double, 4>& slope) {
  const double last = pixels - 1.0;
  const bool inside = at >= 0.0 && at <= last;
  const double place = std::clamp(at, 0.0, last) / last * spans;
  const int span = std::min(static_cast<int>(place), spans - 1);
  const double t = place - span, s = 1.0 - t;
  weight = {s * s * s / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0};
  const double per_pixel = inside ? spans / last : 0.0;
  slope = {-0.5 * s * s * per_pixel, (1.5 * t * t - 2.0 * t) * per_pixel, (2.0 * s - 1.5 * s * s) * per_pixel,
           0.5 * t * t * per_pixel};
  return span;
}

}  // namespace

LensFieldSupport LensField::support(const Eigen::Vector2d& pixel, int width, int height) {
  LensFieldSupport support;
  const int column = weigh(pixel.x(), width, kColumns - 3, support.across, support.across_slope);
  const int row = weigh(pixel.y(), height, kRows - 3, support.down, support.down_slope);
  support.first = column + kColumns * row;
  return support;
}

Eigen::Vector2d LensField::at(const Eigen::Vector2d& pixel, Eigen::Matrix2d* slope) const {
  const LensFieldSupport s = support(pixel, width, height);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  if (slope) slope->setZero();
  for (int j = 0; j < 4; ++j) {
    Eigen::Vector2d line = Eigen::Vector2d::Zero(), line_slope = Eigen::Vector2d::Zero();
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector2d& c = shift[s.coefficient(i, j)];
      line += s.across[i] * c;
      if (slope) line_slope += s.across_slope[i] * c;
    }
    sum += s.down[j] * line;
    if (!slope) continue;
    slope->col(0) += s.down[j] * line_slope;
    slope->col(1) += s.down_slope[j] * line;
  }
  return sum;
}

Eigen::Vector2d LensField::source_of(const Eigen::Vector2d& pixel) const {
  Eigen::Vector2d source = pixel - at(pixel);
  for (int round = 0; round < 10; ++round) {
    Eigen::Matrix2d slope;
    const Eigen::Vector2d miss = source + at(source, &slope) - pixel;
    if (miss.squaredNorm() < 1e-20) break;
    source -= (Eigen::Matrix2d::Identity() + slope).inverse() * miss;
  }
  return source;
}

}  // namespace scanrig
