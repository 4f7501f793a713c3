#pragma once

#include <opencv2/core/mat.hpp>

namespace scanrig {

/// Signed distance, in pixels, to the line where a field given at pixel centres is zero (linear between them);
/// it has the sign of the field. Exact within 3 px of the line, to a fraction of a pixel beyond.
/// A field without a zero gives infinities.
cv::Mat1f contour_distance(const cv::Mat1f& field);

/// Distances of a larger image, `box` in the pixels of this one: beyond this one, its border's and the way to it.
cv::Mat1f distance_beyond(const cv::Mat1f& outside_px, const cv::Rect& box);

}  // namespace scanrig
