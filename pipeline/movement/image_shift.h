#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace scanrig {

/// What happened within one small square of a picture, in pixels.
struct PatchShift {
  double shift_px = 0.0;   ///< across the edges it holds, true up to about a pixel: along an edge nothing can be seen
  double misfit_px = 0.0;  ///< the shift that would change the patch as much as what no shift explains
};

/// What happened between two pictures.
struct PictureShift {
  std::vector<PatchShift> squares;  ///< those that show something; empty where nothing is shown
  double together_px = 0.0;         ///< the one shift that explains all of them best; those with a misfit left out
};

/// A square whose misfit is larger shows something else.
inline constexpr double kOtherPx = 0.5;

/// The squares are small where the pictures are sharp and rich enough, else larger. Light that became brighter or
/// dimmer is no change. `before`, `after`: grey or BGR, 8 bit, of one size.
PictureShift image_shift(const cv::Mat& before, const cv::Mat& after);

}  // namespace scanrig
