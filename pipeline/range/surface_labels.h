#pragma once

#include "pipeline/range/match_side.h"

namespace scanrig {

/// Gives pixels to the surfaces of the matched nodes around them. Where coarse disparities are missing, or where nodes
/// within two strides lie on different surfaces, each surface is laid through the pixel and the images are compared in
/// 7 x 7 px; the pixel takes the disparity of the one that fits. Pixels that none fits better than a window's middle
/// may (StereoOptions::max_centre) become NaN: seen by one camera only, or in shadow. Writes `mask.disparity`.
/// Threads: spread over the current arena, same bits for any number.
void assign_pixels(MatchMask& mask, const Nodes& nodes, const LayeredImage& here, const LayeredImage& there,
                   const StereoOptions& options);

}  // namespace scanrig
