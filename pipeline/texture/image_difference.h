#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig {

struct ComparisonOptions {
  int erosion_px = 6;  ///< of the mask: outlines are another matter than texture
  int patch_px = 48;   ///< side of the patches whose shift is measured, half overlapping
  /// Patches that grey levels with a noise of 2 could not place better than this (of little structure, or structure in
  /// one direction only) say nothing and are left out.
  double patch_sigma_px = 0.1;
};

/// How a rendering differs from a photo of the same thing.
struct ImageDifference {
  double psnr_db = 0.0;           ///< over all channels inside the eroded mask
  double median_offset_px = 0.0;  ///< of the patches; NaN without patches of enough structure
  double p95_offset_px = 0.0;
  int patches = 0;
};

/// Both images 8 bit BGR, `mask` 255 where they can be compared. Fails with `invalid_input` (sizes differ),
/// `degenerate` (nothing left of the mask).
Result<ImageDifference> compare_images(const cv::Mat3b& rendered, const cv::Mat3b& photo, const cv::Mat1b& mask,
                                       const ComparisonOptions& options = {});

}  // namespace scanrig
