#pragma once

#include <opencv2/core/mat.hpp>

namespace scanrig {

/// 255 within `reach_px` of a step of more than `step_mm` in a depth image, or of its outline: a matching window does
/// not hold one surface there.
cv::Mat1b beside_steps(const cv::Mat1f& depth, double step_mm, int reach_px);

}  // namespace scanrig
