#pragma once

#include <opencv2/core/mat.hpp>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/coarse_disparity.h"
#include "pipeline/range/stereo.h"

namespace scanrig {

/// u_left - u_right on the left image's pixels; NaN unknown in every matrix.
struct DenseDisparity {
  cv::Mat1f value;  ///< px
  cv::Mat1f sigma;  ///< px
  cv::Mat2f slope;  ///< d value / du, d value / dv
};

/// Least-squares matching of every object pixel in the boxes, from both images; only agreeing results are kept. Fails
/// with `stopped`.
Result<DenseDisparity> dense_disparity(const RectifiedPair& pair, const CoarseDisparity& coarse, const PairBoxes& boxes,
                                       const StereoOptions& options, const Context& context);

/// Removes pixels that their surroundings contradict: lone pixels, specks, the rims of depth steps.
void remove_outliers(DenseDisparity& disparity, const StereoOptions& options);

}  // namespace scanrig
