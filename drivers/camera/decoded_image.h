#pragma once

#include <span>

#include "drivers/camera/stereo_camera.h"

namespace scanrig {

/// Layout of the bytes that a sensor delivers. Bayer patterns are named by the two pixels at the upper left.
enum class Layout { mono, bayer_rg, bayer_gr, bayer_gb, bayer_bg, rgb, bgr, yuyv, jpeg };

struct RawImage {
  Layout layout = Layout::mono;
  int bits = 8;  ///< per value; values of more than 8 bits are 16-bit little-endian words, low bits first
  cv::Size size;
  std::size_t stride = 0;  ///< bytes from row to row; 0: rows without a gap
  std::span<const std::uint8_t> bytes;
};

struct DecodedImage {
  cv::Mat image;  ///< its own memory
  PixelFormat format = PixelFormat::mono8;
};

/// Image as StereoFrame holds it: the upper 8 bits of longer values. Mono and Bayer RGGB stay as they are; the rest is
/// BGR. Fails with `protocol` (fewer bytes than the image needs, or not a valid JPEG), `unsupported` (bits).
Result<DecodedImage> decode_image(const RawImage& raw);

}  // namespace scanrig
