#pragma once

#include <opencv2/core/mat.hpp>

namespace scanrig {

/// Signed distance, in pixels, to the line where a field given at pixel centres is zero (linear between them);
/// it has the sign of the field. Exact within 3 px of the line, to a fraction of a pixel beyond.
/// A field without a zero gives infinities.
cv::Mat1f contour_distance(const cv::Mat1f& field);

}  // namespace scanrig
