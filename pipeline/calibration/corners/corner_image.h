#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// One pixel for a fit.
struct FitPixel {
  Eigen::Vector2d place;  ///< relative to the patch's origin, pixels
  double value = 0.0;     ///< grey levels
  int colour = 0;         ///< 0 .. CornerImage::colours - 1
};

/// An image of a sensor for fits: every value as the sensor measured it, and which colour it is. A mosaic is not
/// demosaiced; a fit has gain and offset per colour instead.
struct CornerImage {
  cv::Mat raw;      ///< 8 bit, 1 channel (grey or mosaic) or 3 (BGR)
  int colours = 1;  ///< kinds of pixels: 3 in a mosaic (red, green, blue), else 1
  cv::Mat1b grey;   ///< for finding things; a mosaic lightly blurred, so that its colours have equal weights

  [[nodiscard]] int width() const { return raw.cols; }
  [[nodiscard]] int height() const { return raw.rows; }
  [[nodiscard]] int colour(int x, int y) const { return colours == 1 ? 0 : (x & 1) + (y & 1); }  // RGGB
  [[nodiscard]] double value(int x, int y) const;
  [[nodiscard]] bool is_saturated(int x, int y) const;
};

/// Sigma in pixels of the blur of an image's steepest edges, as if they were steps over its whole contrast; nothing
/// where the contrast is too low to tell.
std::optional<double> steepest_edge_px(const cv::Mat1b& grey);

/// `pixel_format` as in manifests: "Mono8", "BayerRG8" (red at 0, 0), "BGR8". Shares the memory of `image`. Fails with
/// `invalid_input` for an image that is not of that format.
Result<CornerImage> make_corner_image(const cv::Mat& image, const std::string& pixel_format);

}  // namespace scanrig
