#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

/// Cubic B-spline coefficients of an image, so that the spline passes through its values [Unser, Splines, 1999].
/// The border is mirrored.
cv::Mat1f spline_coefficients(const cv::Mat1f& image);

/// Weights of the four coefficients around a place `t` past the second of them, 0 <= t < 1.
inline std::array<float, 4> spline_weights(float t) {
  const float s = 1.0F - t;
  return {s * s * s / 6.0F, (3.0F * t * t * t - 6.0F * t * t + 4.0F) / 6.0F,
          (3.0F * s * s * s - 6.0F * s * s + 4.0F) / 6.0F, t * t * t / 6.0F};
}

/// An image as one cubic per pixel along each row: value(x + t) = c[0] + t (c[1] + t (c[2] + t c[3])), 0 <= t < 1, the
/// cubic B-spline through the row's values. Cubics of one row are consecutive.
class CubicRows {
 public:
  explicit CubicRows(const cv::Mat1f& image);
  [[nodiscard]] const float* row(int y) const { return cubics_.data() + size_t(y) * size_t(width_) * 4; }

 private:
  int width_;
  std::vector<float> cubics_;
};

}  // namespace scanrig
