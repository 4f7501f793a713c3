#pragma once

#include "pipeline/range/compact_range.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

/// Of images of a camera every so many pixels, each way, are what registration, the search for the pose, silhouettes
/// and partial models work on: their work and memory are those of about 1.3 MP then. 1 up to 2.9 MP.
int thinning_step(const Projection& sensor);

/// One pixel in `step` each way of range image and silhouettes, the first one included; where the view is cropped the
/// crop must begin at multiples of `step`. Depths and sigmas stay, as of single pixels.
View thinned(const View& view, int step);

/// Brings a view's whole range image to what became of its thinned one: its place, background that was doubted, and
/// pixels taken in again that were cropped off.
void follow_thinned(CompactRange& whole, const RangeImage& thinned, int step);

}  // namespace scanrig
