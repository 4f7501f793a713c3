#pragma once

#include <opencv2/core/mat.hpp>

namespace scanrig {

/// The rectangle of the pixels that are not 0 and `margin` px around it, within the image; empty where there are none.
cv::Rect box_around(const cv::Mat1b& mask, int margin);

}  // namespace scanrig
