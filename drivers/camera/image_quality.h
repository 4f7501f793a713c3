#pragma once

#include "drivers/camera/stereo_camera.h"

namespace scanrig {

/// Measures an image of a StereoFrame. Of a Bayer mosaic it samples one green site in four pixels, of a colour image
/// the green channel. The blur is that of a texture of independent grains, such as projected dots. It is NaN for an
/// image without such texture.
ImageQuality measure(const cv::Mat& image, PixelFormat format);

/// Strength of the fine texture, noise included: rms of what neighbouring samples differ by, as that of independent
/// pixels, 0 to 1 of full scale. Of the samples that measure() takes.
double texture(const cv::Mat& image, PixelFormat format);

/// StereoFrame::left_right_correlation of two images of one size; NaN without any texture.
double left_right_correlation(const cv::Mat& left, const cv::Mat& right, PixelFormat format);

}  // namespace scanrig
