#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

/// What happened within one small square of a picture, in pixels.
struct PatchShift {
  double shift_px = 0.0;  ///< across the edges it holds: along an edge nothing can be seen
  double misfit_px = 0.0;  ///< the shift that would change the patch as much as what no shift explains
};

/// Those squares of `before` that show something, and how far each moved up to about a pixel. Light that became brighter
/// or dimmer is no change. Both images: BGR or grey, 8 bit, of one size.
std::vector<PatchShift> patch_shifts(const cv::Mat& before, const cv::Mat& after);

}  // namespace scanrig
