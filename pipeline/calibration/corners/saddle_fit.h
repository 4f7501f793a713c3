#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "pipeline/calibration/corners/corner_image.h"

namespace scanrig {

/// Where two edges of a chessboard cross.
struct Saddle {
  Eigen::Vector2d place{0.0, 0.0};            ///< pixels
  std::array<Eigen::Vector2d, 2> directions;  ///< unit, along both edges, in the image
  double blur_px = 1.0;                       ///< sigma of the edges, the pixel's own width included
  double contrast = 0.0;                      ///< half of white minus black, grey levels, mean over the patch
  double noise = 0.0;                         ///< rms of what the fit leaves, grey levels
};

/// Fits a blurred crossing of two straight edges to the pixels of a patch: place, both directions, blur, gain and
/// offset per colour, and the light's slope. The model is exact for straight edges and a Gaussian blur, whatever their
/// angle. `contrast` is positive where the quadrants between +direction 0 and +direction 1, and opposite, are the
/// bright ones. Needs from `start` the place (as in `pixels`), directions and blur. No value: not converged. Threads:
/// any.
std::optional<Saddle> fit_saddle(std::span<const FitPixel> pixels, int colours, const Saddle& start);

}  // namespace scanrig
