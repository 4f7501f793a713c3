#pragma once

#include <cmath>
#include <opencv2/core/mat.hpp>

namespace scanrig::bench {

/// A smooth field of row offsets over an image, at most `size_px`, and no polynomial.
inline float row_field(double u, double v, cv::Size image, double size_px) {
  const double x = 2.0 * u / image.width - 1.0, y = 2.0 * v / image.height - 1.0;
  return static_cast<float>(size_px * std::sin(1.2 * x + 0.9) * std::cos(0.9 * y - 0.3));
}

}  // namespace scanrig::bench
