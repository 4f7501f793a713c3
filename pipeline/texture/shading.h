#pragma once

#include <Eigen/Core>
#include <opencv2/core/matx.hpp>
#include <opencv2/core/types.hpp>

namespace scanrig {

/// 8-bit sRGB of linear values; 1 = white [IEC 61966-2-1]. The order of the channels stays.
cv::Vec3b to_srgb(const Eigen::Vector3f& linear);
Eigen::Vector3f from_srgb(const cv::Vec3b& encoded);

}  // namespace scanrig
