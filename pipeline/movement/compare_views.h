#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>

#include "core/result.h"
#include "pipeline/movement/image_shift.h"

namespace scanrig {

/// Limits from rendered views, see the README.
struct CompareViewsOptions {
  double max_shift_px = 0.25;   ///< unmoved views stayed below 0.16 px; at full size this is 0.04 mm on the object
  double max_changed = 0.2;     ///< share of the squares that may have changed content: gloss, dust, a reflection
  double max_grey_step = 4.0;   ///< mean difference of images without structure, in grey levels
  std::size_t min_squares = 3;  ///< fewer squares do not represent the scene
  std::size_t squares_per_moved = 20;  ///< the judged shift is exceeded by one square in this many
  double object_reach =
      2.0 / 3.0;  ///< radius of an object as a share of the table's: working volume 120 mm, table 180 mm
  ImageShiftOptions shift;
};

/// Change of one camera's image.
struct ViewChange {
  int squares = 0;  ///< of the images, with enough structure to measure a shift
  /// Exceeded by a twentieth of them, at least three, or the common shift; accurate up to about a pixel.
  double shift_px = 0.0;
  double changed = 0.0;  ///< share that no small shift explains; 0 or 1 for images without structure
  bool unmoved = true;   ///< within the options
};

/// Checks whether two images of the same view, taken at different times, show the same scene: no object slipped, the
/// table angle and the camera are unchanged. The images are compared square by square, by least squares [Lucas and
/// Kanade 1981], so that outline and shading of a smooth object count as much as texture. A change of brightness of the
/// light is no change of the scene. `before`, `after`: 8 bit, grey or BGR. Fails with `invalid_input` (not such images,
/// sizes differ).
Result<ViewChange> compare_views(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options = {});

}  // namespace scanrig
