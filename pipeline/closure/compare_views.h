#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig {

struct CompareViewsOptions {
  double most_shift_px = 0.75;  ///< a table that repeats its angle to 0.02 deg stays below 0.3 px at full size
  double most_changed = 0.2;    ///< share of the features that may be lost to noise, gloss and flicker
  double most_grey_step = 4.0;  ///< mean difference of images without features, in grey levels
};

/// What has become of one camera's picture.
struct ViewChange {
  int features = 0;       ///< corners found in the first image
  double shift_px = 0.0;  ///< of those found again: four in five moved less
  double changed = 0.0;   ///< share that was not found again; of images without features 0 or 1
  bool unmoved = true;    ///< within the options
};

/// Whether two images of the same view, taken at different times under the same light, show the same scene: nothing on
/// the table slipped, the table is where it was, the camera was not knocked. Corners of the first image are followed
/// into the second and back [Shi and Tomasi 1994; Bouguet's pyramids of Lucas and Kanade].
/// `before`, `after`: 8 bit, grey or BGR. Fails with `invalid_input` (not such images, sizes differ).
Result<ViewChange> compare_views(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options = {});

}  // namespace scanrig
