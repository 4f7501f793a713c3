#pragma once

#include <span>

#include "drivers/camera/stereo_camera.h"

namespace scanrig {

/// How the bytes a sensor delivers are laid out. Bayer patterns are named by the two pixels at the upper left.
enum class Layout { mono, bayer_rg, bayer_gr, bayer_gb, bayer_bg, rgb, bgr, yuyv, jpeg };

struct RawImage {
  Layout layout = Layout::mono;
  int bits = 8;  ///< of a value; more than 8 stand in 16-bit little-endian words, low bits first
  cv::Size size;
  std::size_t stride = 0;  ///< bytes from row to row; 0: rows without a gap
  std::span<const std::uint8_t> bytes;
};

struct DecodedImage {
  cv::Mat image;  ///< its own memory
  PixelFormat format = PixelFormat::mono8;
};

/// What the interface hands out: of more than 8 bits the upper 8; mono and Bayer RGGB as they are, everything else as
/// BGR. Fails with `protocol` (fewer bytes than the image needs, or a JPEG that is none), `unsupported` (bits).
Result<DecodedImage> decode_image(const RawImage& raw);

}  // namespace scanrig
