#pragma once

#include "drivers/camera/stereo_camera.h"

namespace scanrig {

/// Measures an image of a StereoFrame. Of a Bayer mosaic one green site in four pixels is looked at, of a colour image
/// the green channel. The blur is that of a texture of independent grains, such as projected dots, and is NaN for an
/// image without any.
ImageQuality measure(const cv::Mat& image, PixelFormat format);

/// StereoFrame::left_right_correlation of two images of one size; NaN without any texture.
double left_right_correlation(const cv::Mat& left, const cv::Mat& right, PixelFormat format);

}  // namespace scanrig
