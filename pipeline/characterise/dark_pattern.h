#pragma once

#include <vector>

#include "pipeline/characterise/flat_planes.h"

namespace scanrig::flats {

/// What all dark images together show.
struct DarkPattern {
  double black = 0.0;
  double variance = 0.0;       ///< of a pixel in time
  double clipped_share = 0.0;  ///< of the pixels: at 0
  double dsnu = 0.0, column = 0.0, row = 0.0;
  std::vector<HotPixel> hot_pixels;  ///< brightest first
  cv::Mat1b defects;                 ///< nonzero at hot pixels, in the image's size
};

/// Of the dark pairs, of which there is at least one.
DarkPattern dark_pattern(const std::vector<const FlatPair*>& darks, const Linear& linear, int window);

}  // namespace scanrig::flats
