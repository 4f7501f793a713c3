#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "core/result.h"

/// Images to bytes of a file and back. The format libraries are called directly: OpenCV's own image reader loads a
/// hundred libraries of formats that no rig has, at every program start.
/// Every function may be called from any thread. An image has 8 bit, one channel (grey) or three (BGR), unless stated
/// otherwise, and at most kMaxImagePixels. All fail with `invalid_input`.
namespace scanrig {

inline constexpr std::size_t kMaxImagePixels = 1 << 27;

/// Favours speed over size: sensor images are noise to a compressor.
Result<std::vector<std::byte>> encode_png(const cv::Mat& image);
/// Grey, colour or a palette; not 16 bit, no alpha. A file that ends before its IEND chunk is refused.
Result<cv::Mat> decode_png(std::string_view bytes);

/// `quality`: per cent. Colour is kept at half the resolution (4:2:0).
Result<std::vector<std::byte>> encode_jpeg(const cv::Mat& image, int quality);
/// BGR, of grey files too. Also a frame of Motion JPEG, which leaves the Huffman tables out. Cut or damaged ones are
/// refused.
Result<cv::Mat> decode_jpeg(std::string_view bytes);

/// 32-bit float, one channel; NaN is kept.
Result<std::vector<std::byte>> encode_tiff(const cv::Mat1f& depth);
Result<cv::Mat> decode_tiff(std::string_view bytes);

/// A PNG or a TIFF, by its first bytes.
Result<cv::Mat> decode_image(std::string_view bytes);

/// An image of anybody's camera: PNG or TIFF, grey or colour, 8 or 16 bits a channel as the result has them; alpha is
/// dropped. TIFF in strips, samples side by side.
Result<cv::Mat> decode_camera_image(std::string_view bytes);

/// Whether an image of that size may be decoded at all.
constexpr bool is_image_size(std::uint64_t width, std::uint64_t height) {
  return width > 0 && height > 0 && width < kMaxImagePixels && width * height <= kMaxImagePixels;
}

inline std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace scanrig
