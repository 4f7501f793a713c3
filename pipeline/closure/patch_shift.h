#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

/// What happened within one small square of a picture, in pixels.
struct PatchShift {
  double shift_px = 0.0;   ///< across the edges it holds, true up to about a pixel: along an edge nothing can be seen
  double misfit_px = 0.0;  ///< the shift that would change the patch as much as what no shift explains
};

/// The squares of two pictures that show something, and what happened in each. They are small where the pictures are
/// sharp and rich enough, else larger. Light that became brighter or dimmer is no change. Empty where nothing is shown.
/// `before`, `after`: grey or BGR, 8 bit, of one size.
std::vector<PatchShift> patch_shifts(const cv::Mat& before, const cv::Mat& after);

}  // namespace scanrig
