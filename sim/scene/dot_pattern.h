#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig::sim {

/// The projector's pattern: random dots on its mirrors, seen through its lens, averaged over any width. A pyramid of
/// Gaussian blurs, so that a lookup never meets an edge sharper than its averaging width.
class DotPattern {
 public:
  /// Dots sized for a camera of `image_scale` times the full resolution: 3 of ITS pixels mixed with 2 and 5.
  explicit DotPattern(double image_scale = 1.0);

  /// Brightness, 0 to 1, at projector pixel (u, v) under a Gaussian of `sigma` projector pixels, lens included. Outside
  /// the raster: 0. Blur below the lens's own is the lens's own.
  [[nodiscard]] float brightness(double u, double v, double sigma) const;

 private:
  struct Level {
    double sigma = 0.0;      // projector pixels
    double per_pixel = 1.0;  // samples a projector pixel
    cv::Mat samples;         // 16 bit
  };
  std::vector<Level> levels_;
};

}  // namespace scanrig::sim
