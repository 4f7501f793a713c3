#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace scanrig {

/// What one camera saw of a view in both lights, 8 bit, any channels, a Bayer mosaic too.
struct ExposedPair {
  cv::Mat pattern, plain;
};

/// Of the `offered` exposures of the pattern, as multiples of the one that was taken, those that this view wants
/// besides: longer ones (above 1) where a part of it is dark in both lights, as an object is and a screen is not;
/// shorter ones where a part of the pattern is saturated. In the order offered.
/// The decision is made within the view and not by the view before: the next view shows another side.
std::vector<double> wanted_exposures(const std::vector<ExposedPair>& seen, std::span<const double> offered);

}  // namespace scanrig
