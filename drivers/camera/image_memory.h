#pragma once

#include <opencv2/core/mat.hpp>

namespace scanrig {

/// An image without content. Reuses the memory of a released image of the same size, if any: the first touch of
/// fresh pages takes longer than a frame's way through this process. Up to `kImagesKept` released blocks are kept for
/// their next use, until the process ends.
/// Threads: any; an image may be released on another.
cv::Mat new_image(cv::Size size, int type);
cv::Mat copy_of(const cv::Mat& image);

inline constexpr std::size_t kImagesKept = 16;  ///< four views: one is taken, others wait to be stored

}  // namespace scanrig
