#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig {

/// The limits stand on rendered views, see the README.
struct CompareViewsOptions {
  double max_shift_px = 0.25;  ///< unmoved views stayed below 0.16 px; at full size this is 0.04 mm on the object
  double max_changed = 0.2;    ///< share of the squares that may show something else: gloss, dust, a reflection
  double max_grey_step = 4.0;  ///< mean difference of images that show nothing, in grey levels
};

/// What has become of one camera's picture.
struct ViewChange {
  int squares = 0;        ///< of the images, that show enough to tell a shift
  double shift_px = 0.0;  ///< a twentieth of them, at least three, or all together; true up to about a pixel
  double changed = 0.0;   ///< share that no small shift explains; of images that show nothing 0 or 1
  bool unmoved = true;    ///< within the options
};

/// Whether two images of the same view, taken at different times, show the same scene: nothing on the table slipped,
/// the table is where it was, the camera was not knocked. The images are compared square by square, by least squares
/// [Lucas and Kanade 1981], so that outline and shading of a smooth object count as much as the texture of another;
/// light that became a little brighter or dimmer is no change. `before`, `after`: 8 bit, grey or BGR. Fails with
/// `invalid_input` (not such images, sizes differ).
Result<ViewChange> compare_views(const cv::Mat& before, const cv::Mat& after, const CompareViewsOptions& options = {});

}  // namespace scanrig
