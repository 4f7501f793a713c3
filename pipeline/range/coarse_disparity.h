#pragma once

#include <opencv2/core/mat.hpp>

#include "pipeline/range/pair_boxes.h"
#include "pipeline/range/stereo.h"

namespace scanrig {

/// Disparities to about a third of a pixel, of both images of a rectified pair: u_left - u_right, px, NaN unknown.
struct CoarseDisparity {
  cv::Mat1f left;   ///< on the left image's pixels
  cv::Mat1f right;  ///< on the right image's pixels
};

/// Semi-global matching [Hirschmueller 2008; OpenCV, MODE_SGBM_3WAY] on images freed of shading, each image in its
/// turn, in the boxes. Of a pair with masks only those are searched that lie about as far from a quadratic surface
/// as disparities found at a quarter of the size do. Throws what OpenCV throws.
CoarseDisparity coarse_disparity(const RectifiedPair& pair, const PairBoxes& boxes);

/// Disparities that the other image's disparities confirm within a tolerance; surface seen by one camera only becomes
/// NaN. `towards`: -1 from the left image to the right, +1 back.
cv::Mat1f confirmed(const cv::Mat1f& here, const cv::Mat1f& there, float towards, float tolerance_px);

}  // namespace scanrig
