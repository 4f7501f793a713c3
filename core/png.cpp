#include <spng.h>

#include <cstdlib>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/image_codec.h"

namespace scanrig {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kEnd("\0\0\0\0IEND\xAE\x42\x60\x82", 12);  ///< the IEND chunk, whole
constexpr int kFastest = 1;                                           ///< level of zlib

using Context = std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)>;

tl::unexpected<Error> complaint(const char* doing, int code) {
  return fail(ErrorCode::invalid_input, "the PNG image cannot be {}: {}", doing, spng_strerror(code));
}

Result<std::vector<std::byte>> encode(const cv::Mat& image) {
  const Context context(spng_ctx_new(SPNG_CTX_ENCODER), spng_ctx_free);
  spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
  spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, kFastest);
  spng_set_option(context.get(), SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB);
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(image.cols);
  header.height = static_cast<std::uint32_t>(image.rows);
  header.bit_depth = 8;
  header.color_type = image.channels() == 1 ? SPNG_COLOR_TYPE_GRAYSCALE : SPNG_COLOR_TYPE_TRUECOLOR;
  int code = spng_set_ihdr(context.get(), &header);
  if (code == 0) {
    code = spng_encode_image(context.get(), image.data, image.total() * image.elemSize(), SPNG_FMT_PNG,
                             SPNG_ENCODE_FINALIZE);
  }
  std::size_t size = 0;
  const std::unique_ptr<void, decltype(&std::free)> file(
      code == 0 ? spng_get_png_buffer(context.get(), &size, &code) : nullptr, std::free);
  if (!file) return complaint("encoded", code);
  const auto* bytes = static_cast<const std::byte*>(file.get());
  return std::vector<std::byte>(bytes, bytes + size);
}

bool has_alpha(const spng_ihdr& header) {
  return header.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA || header.color_type == SPNG_COLOR_TYPE_TRUECOLOR_ALPHA;
}

}  // namespace

Result<std::vector<std::byte>> encode_png(const cv::Mat& image) {
  const bool fits = image.depth() == CV_8U && (image.channels() == 1 || image.channels() == 3);
  if (image.empty() || !fits) {
    return fail(ErrorCode::invalid_input, "the image cannot be encoded as PNG: it is not 8 bit grey or BGR");
  }
  if (image.channels() == 1) return encode(image.isContinuous() ? image : image.clone());
  cv::Mat rgb;
  cv::cvtColor(image, rgb, cv::COLOR_BGR2RGB);
  return encode(rgb);
}

Result<cv::Mat> decode_png(std::string_view bytes) {
  const Context context(spng_ctx_new(0), spng_ctx_free);
  spng_ihdr header{};
  int code = spng_set_png_buffer(context.get(), bytes.data(), bytes.size());
  if (code == 0) code = spng_get_ihdr(context.get(), &header);
  if (code != 0) return complaint("decoded", code);
  if (header.bit_depth > 8 || has_alpha(header) || !is_image_size(header.width, header.height)) {
    return fail(ErrorCode::invalid_input, "the PNG image is not 8 bit grey or colour without alpha, or is too large");
  }
  const bool grey = header.color_type == SPNG_COLOR_TYPE_GRAYSCALE;
  cv::Mat image(static_cast<int>(header.height), static_cast<int>(header.width), grey ? CV_8UC1 : CV_8UC3);
  const int format = grey ? SPNG_FMT_G8 : SPNG_FMT_RGB8;
  code = spng_decode_image(context.get(), image.data, image.total() * image.elemSize(), format, 0);
  if (code == 0) code = spng_decode_chunks(context.get());
  if (code != 0) return complaint("decoded", code);
  if (bytes.find(kEnd) == std::string_view::npos)
    return fail(ErrorCode::invalid_input, "the PNG image is cut short: its end is missing");
  if (!grey) cv::cvtColor(image, image, cv::COLOR_RGB2BGR);
  return image;
}

Result<cv::Mat> decode_image(std::string_view bytes) {
  if (bytes.starts_with(kSignature)) return decode_png(bytes);
  if (bytes.starts_with("II*") || bytes.starts_with("MM")) return decode_tiff(bytes);
  return fail(ErrorCode::invalid_input, "not a PNG or TIFF image");
}

}  // namespace scanrig
