#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig {

struct BlueScreenOptions {
  double min_blue_share = 0.45;        ///< B / (B + G + R) of a screen that can serve as a key
  double object_key = 0.6;             ///< 0: grey, 1: the screen's chroma; an object's pixel lies below this
  double smallest_part_share = 0.005;  ///< of the largest part; smaller islands are specks
  int smallest_hole_px = 40;           ///< smaller openings are highlights or noise, larger ones show the screen
};

/// The object's outline before a blue screen and on a blue table, by chroma (shadows on blue stay blue), to sub-pixel:
/// the line where half of a pixel's light comes from the object. `image`: BGR, 8 bit, linear light, even illumination.
/// The screen's chroma is taken from the image's border.
/// Returns the signed distance to the outline in pixels, positive outside the object, of the image's size.
/// Fails with `invalid_input` (not BGR, 8 bit), `degenerate` (no blue border, no object), `out_of_range` (the object
/// reaches the border).
Result<cv::Mat1f> blue_screen_outline(const cv::Mat& image, const BlueScreenOptions& options = {});

}  // namespace scanrig
