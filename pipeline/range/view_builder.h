#pragma once

#include <opencv2/core/mat.hpp>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/rectification.h"
#include "pipeline/range/stereo.h"
#include "pipeline/silhouette/blue_screen.h"

namespace scanrig {

/// The sensors' images of one view, 8 bit, all BGR or all grey.
struct StereoImages {
  cv::Mat left_pattern, right_pattern;  ///< projector on; may be merged exposures
  cv::Mat left_plain, right_plain;      ///< projector off, plain light; not needed when grey
};

struct ViewOptions {
  StereoOptions stereo;
  BlueScreenOptions silhouette;
  double mixed_px = 1.5;       ///< pixels this near to the outline contain light from behind the object: not in windows
  float rim_px = 2.5f;         ///< depth this near to the outline is left out: the surface turns away there
  double background_px = 1.0;  ///< free space starts this far outside the outline, so that no mixed pixel claims it
  double table_clearance_mm = 0.5;  ///< without a blue screen, what is lower counts as the table
  bool plain_differs = true;  ///< false: the object has the background's plain light; free space does not grow by it
};

/// All data of one table angle: range image in the rectified left camera's frame with its background, and both
/// silhouettes. Grey images, and colour images without a screen of one colour or with an object of just this colour:
/// table and surroundings are separated from the object by height and radius; background and silhouettes are what
/// free_space() finds, and `background_is_whole` is false.
/// `angle_rad` is the table's measured angle.
/// Fails with `invalid_input` (sizes, types), `degenerate` (no screen, nothing seen or matched), `out_of_range` (the
/// object reaches the border of an image), `stopped`.
Result<View> make_view(const Rectification& rectification, const StereoImages& images, double angle_rad, int index,
                       const ViewOptions& options, const Context& context);

}  // namespace scanrig
