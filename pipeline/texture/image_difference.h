#pragma once

#include <opencv2/core/mat.hpp>

#include "core/result.h"

namespace scanrig {

struct ComparisonOptions {
  int erosion_px = 6;  ///< of the mask: outlines are judged elsewhere
  int patch_px = 48;   ///< side of the patches whose shift is measured, half overlapping
  /// Maximum placement error of a patch at a noise of 2 grey levels. Patches beyond it (of little structure, or
  /// structure in one direction only) are left out.
  double patch_sigma_px = 0.1;
};

/// Difference between a rendering and a photo of the same object.
struct ImageDifference {
  double psnr_db = 0.0;           ///< over all channels inside the eroded mask
  double median_offset_px = 0.0;  ///< of the patches; NaN without patches of enough structure
  double p95_offset_px = 0.0;
  int patches = 0;
};

/// Both images 8 bit BGR, `mask` 255 where they can be compared. Fails with `invalid_input` (sizes differ),
/// `degenerate` (empty mask after erosion).
Result<ImageDifference> compare_images(const cv::Mat3b& rendered, const cv::Mat3b& photo, const cv::Mat1b& mask,
                                       const ComparisonOptions& options = {});

}  // namespace scanrig
