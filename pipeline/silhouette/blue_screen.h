#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig {

struct BlueScreenOptions {
  int border_px = 12;           ///< width of the frame around the image that shows the screen
  float dark_level = 12;        ///< sum of B, G, R below which chroma is noise
  int mixed_band_px = 7;        ///< diameter of the disc around the mask's edge in which pixels can be mixed
  int colour_window_px = 15;    ///< side of the window for the colours of object and screen near a mixed pixel
  float min_contrast = 25.0f;   ///< grey levels squared between these colours; with less a mixture cannot be separated
  double min_key_share = 0.45;  ///< of a screen's light in its strongest channel, to serve as a key
  double object_key = 0.6;      ///< 0: grey, 1: the screen's chroma; an object's pixel lies below this
  double lit_key = 0.4;         ///< the same in the pattern's light
  double min_part_share = 0.005;  ///< of the largest part; smaller islands are specks
  int min_hole_px = 40;           ///< smaller openings are highlights or noise, larger ones show the screen
};

/// The object's outline before a screen and on a table of one colour, by chroma (shadows on it keep the colour), to
/// sub-pixel: the line where half of a pixel's light comes from the object. `image`: BGR, 8 bit, linear light, plain
/// light. The screen's colour, blue, green or red, is taken from the image's border. `pattern`: the same with the
/// projector on, 8 bit or merged exposures, or empty; a dark glossy surface mirrors screen and table, but what the
/// projector lights directly has its own colour there.
/// Returns the signed distance to the outline in pixels, positive outside the object, of the image's size.
/// Fails with `invalid_input` (not BGR, 8 bit), `degenerate` (the border is dark), `not_found` (the border has no
/// colour to key by, or nothing differs from it), `out_of_range` (the object reaches the border).
Result<cv::Mat1f> blue_screen_outline(const cv::Mat& image, const cv::Mat& pattern = {},
                                      const BlueScreenOptions& options = {});

/// The same distance for an object known to a few pixels: `mask` is 255 on it and up to `mixed_band_px` / 2 too large
/// or too small. Where object and surroundings have the same light its edge stays. `image`: BGR, 8 bit.
cv::Mat1f outline_near(const cv::Mat& image, const cv::Mat1b& mask, const cv::Mat1b& surely_object,
                       const BlueScreenOptions& options = {});

}  // namespace scanrig
