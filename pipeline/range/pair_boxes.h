#pragma once

#include <opencv2/core/types.hpp>

#include "pipeline/range/stereo.h"

namespace scanrig {

/// The parts of both images that show the object and some around: of one size, in the same rows. Without masks the
/// whole images.
struct PairBoxes {
  cv::Rect left, right;

  /// Disparities in the boxes are smaller by it.
  [[nodiscard]] int shift() const { return left.x - right.x; }
};

/// `rows`: of both images.
PairBoxes object_boxes(const RectifiedPair& pair, cv::Range rows);

}  // namespace scanrig
