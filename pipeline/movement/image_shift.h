#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

/// Squares and noise limits of the comparison.
struct ImageShiftOptions {
  int min_side_px = 24;              ///< of the squares
  int max_side_px = 96;              ///< of the squares, where smaller ones show too little structure
  std::size_t good_squares = 8;      ///< this many squares represent the whole image
  double smoothing_px = 1.0;         ///< sigma, against noise and the traces of demosaicing
  double max_noise_shift_px = 0.05;  ///< a direction in which noise alone would shift a square by more is ignored
  double correlated_pixels = 15.0;   ///< pixels that share their noise after smoothing and demosaicing
  double min_noise = 0.01;           ///< grey levels squared: minimum noise of an image, from its quantisation
  double max_misfit_px = 0.5;        ///< a square with a larger misfit shows another scene
};

/// Change within one small square of an image, in pixels.
struct PatchShift {
  /// Across the edges it holds, accurate up to about a pixel: along an edge no shift can be seen.
  double shift_px = 0.0;
  double misfit_px = 0.0;  ///< the shift that would change the patch as much as the residual that no shift explains
};

/// Change between two images.
struct ImageShift {
  std::vector<PatchShift> squares;  ///< those with structure; empty for images without structure
  double together_px = 0.0;         ///< the one shift that explains all of them best; those with a misfit left out
};

/// The squares are small where the images are sharp and rich enough, else larger. A change of brightness of the light
/// is no change. `before`, `after`: grey or BGR, 8 bit, of one size.
ImageShift image_shift(const cv::Mat& before, const cv::Mat& after, const ImageShiftOptions& options = {});

}  // namespace scanrig
