#pragma once

#include <opencv2/core/mat.hpp>

namespace scanrig {

/// An image without content. Its memory is that of an image of the same size which nobody has any more, if there is
/// one: the first touch of fresh pages takes longer than a frame's way through this process. Up to `kImagesKept` wait
/// for their next use, for as long as the process lives.
/// Threads: any; an image may be let go on another.
cv::Mat new_image(cv::Size size, int type);
cv::Mat copy_of(const cv::Mat& image);

inline constexpr std::size_t kImagesKept = 16;  ///< four views: one is taken, others wait for the disk

}  // namespace scanrig
