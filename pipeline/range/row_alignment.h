#pragma once

#include "core/result.h"
#include "pipeline/range/coarse_disparity.h"
#include "pipeline/range/row_offsets.h"
#include "pipeline/range/stereo.h"

namespace scanrig {

struct RowAlignmentOptions {
  double min_px = 0.05;        ///< a smaller field is left as it is
  double max_px = 3.0;         ///< a larger one is refused
  double again_px = 0.5;       ///< above it coarse matching is done again
  int max_windows = 2000;      ///< measured from coarse disparities
  double min_explained = 0.5;  ///< share of the windows that must fit a field

  // Search, where coarse matching fails because rows are too far apart.
  int search_rows_px = 8;  ///< this far up and down
  int search_cells = 12;   ///< windows searched: the best textured one of each of so many cells squared
  int search_radius_px = 10;
  double search_explained = 0.4;
};

/// Measures the field of row offsets of a pair from coarse disparities, and moves the rows of the right image and its
/// mask so that they correspond. The LEFT camera is held true: its pixels keep their lines of sight. Of the right image
/// only rows move; columns stay as calibrated, so a disparity, and its depth, is that of the columns alone. `coarse` is
/// computed again where rows were far off.
/// Returns the field taken out, on the right image's pixels; zero where rows correspond or nothing is measured.
/// Threads: spread over the current arena, same bits for any number.
/// Fails with `refused`: rows are so far off that the calibration cannot be that of these cameras. Throws what OpenCV
/// throws.
Result<RowField> align_rows(RectifiedPair& pair, CoarseDisparity& coarse, const PairBoxes& boxes,
                            const RowAlignmentOptions& options = {});

}  // namespace scanrig
