#include "drivers/camera/decoded_image.h"

#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/image_codec.h"
#include "drivers/camera/image_memory.h"

namespace scanrig {
namespace {

int channels(Layout layout) {
  switch (layout) {
    case Layout::rgb:
    case Layout::bgr: return 3;
    case Layout::yuyv: return 2;
    default: return 1;
  }
}

/// Conversion from the camera's colour layout to BGR; nothing for layouts that are kept.
/// OpenCV names a Bayer pattern by the pixels at (1,1) and (1,2).
std::optional<int> to_bgr(Layout layout) {
  switch (layout) {
    case Layout::bayer_gr: return cv::COLOR_BayerGB2BGR;
    case Layout::bayer_gb: return cv::COLOR_BayerGR2BGR;
    case Layout::bayer_bg: return cv::COLOR_BayerRG2BGR;
    case Layout::rgb: return cv::COLOR_RGB2BGR;
    case Layout::yuyv: return cv::COLOR_YUV2BGR_YUYV;
    default: return std::nullopt;
  }
}

Result<DecodedImage> decode(const RawImage& raw) {
  const std::string_view bytes(reinterpret_cast<const char*>(raw.bytes.data()), raw.bytes.size());
  const auto image = decode_jpeg(bytes);
  if (!image) return fail(ErrorCode::protocol, "camera: {} bytes: {}", raw.bytes.size(), image.error().message);
  if (image->size() != raw.size) {
    return fail(ErrorCode::protocol, "camera: a JPEG image of {}x{} that should be of {}x{}", image->cols, image->rows,
                raw.size.width, raw.size.height);
  }
  return DecodedImage{*image, PixelFormat::bgr8};
}

cv::Mat upper_8_bits(const cv::Mat& words, int bits) {
  cv::Mat bytes = new_image(words.size(), CV_MAKETYPE(CV_8U, words.channels()));
  const int values = words.cols * words.channels();
  for (int y = 0; y < words.rows; ++y) {
    const auto* from = words.ptr<std::uint16_t>(y);
    auto* to = bytes.ptr<std::uint8_t>(y);
    for (int x = 0; x < values; ++x) to[x] = static_cast<std::uint8_t>(std::min(from[x] >> (bits - 8), 255));
  }
  return bytes;
}

Result<DecodedImage> convert(const RawImage& raw) {
  if (raw.layout == Layout::jpeg) return decode(raw);
  if (raw.bits < 8 || raw.bits > 16 || (raw.bits > 8 && raw.layout == Layout::yuyv)) {
    return fail(ErrorCode::unsupported, "camera: pixels of {} bits cannot be read", raw.bits);
  }
  const int depth = raw.bits > 8 ? CV_16U : CV_8U;
  const int type = CV_MAKETYPE(depth, channels(raw.layout));
  const std::size_t row = static_cast<std::size_t>(raw.size.width) * CV_ELEM_SIZE(type);
  const std::size_t stride = raw.stride == 0 ? row : raw.stride;
  const std::size_t needed = raw.size.height > 0 ? stride * static_cast<std::size_t>(raw.size.height - 1) + row : 0;
  if (needed == 0 || stride < row || raw.bytes.size() < needed) {
    return fail(ErrorCode::protocol, "camera: {} bytes are no image of {}x{}", raw.bytes.size(), raw.size.width,
                raw.size.height);
  }
  const cv::Mat seen(raw.size, type, const_cast<std::uint8_t*>(raw.bytes.data()), stride);
  if (const auto code = to_bgr(raw.layout)) {
    DecodedImage decoded{new_image(raw.size, CV_8UC3), PixelFormat::bgr8};
    cv::cvtColor(raw.bits > 8 ? upper_8_bits(seen, raw.bits) : seen, decoded.image, *code);
    return decoded;
  }
  DecodedImage decoded{raw.bits > 8 ? upper_8_bits(seen, raw.bits) : copy_of(seen), PixelFormat::mono8};
  if (raw.layout == Layout::bgr) {
    decoded.format = PixelFormat::bgr8;
  } else if (raw.layout == Layout::bayer_rg) {
    decoded.format = PixelFormat::bayer_rggb8;
  }
  return decoded;
}

}  // namespace

Result<DecodedImage> decode_image(const RawImage& raw) {
  try {
    return convert(raw);
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::protocol, "camera: image of {}x{}: {}", raw.size.width, raw.size.height, error.what());
  }
}

}  // namespace scanrig
