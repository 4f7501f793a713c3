#pragma once

#include <Eigen/Core>
#include <opencv2/core/matx.hpp>
#include <opencv2/core/types.hpp>
#include <vector>

namespace scanrig {

/// 8-bit sRGB of linear values; 1 = white [IEC 61966-2-1]. The order of the channels stays.
cv::Vec3b to_srgb(const Eigen::Vector3f& linear);
Eigen::Vector3f from_srgb(const cv::Vec3b& encoded);

/// The gain of linear values that brings the brightest paint to a suitable white.
struct WhiteOptions {
  double share = 0.99;    ///< this share of the values lies below the brightest paint, which ...
  double white = 0.8;     ///< ... is brought to this linear value ...
  double max_gain = 3.0;  ///< ... unless that takes more gain than this: a dark object stays dark
};
/// 1 for no values.
double white_gain(std::vector<float> brightness, const WhiteOptions& options = {});

}  // namespace scanrig
