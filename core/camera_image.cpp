// Camera images of other programs: what encode_png() and encode_tiff() never write.
#include <spng.h>
#include <tiffio.h>
#include <tiffio.hxx>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/image_codec.h"
#include "core/tiff_field.h"

namespace scanrig {
namespace {

Result<cv::Mat> camera_png(std::string_view bytes) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), spng_ctx_free);
  spng_ihdr header{};
  int code = spng_set_png_buffer(context.get(), bytes.data(), bytes.size());
  if (code == 0) code = spng_get_ihdr(context.get(), &header);
  if (code == 0 && !is_image_size(header.width, header.height)) {
    return fail(ErrorCode::invalid_input, "the PNG image is too large");
  }
  const bool deep = header.bit_depth == 16;
  cv::Mat image;
  if (code == 0) {
    image.create(static_cast<int>(header.height), static_cast<int>(header.width), deep ? CV_16UC4 : CV_8UC4);
    code = spng_decode_image(context.get(), image.data, image.total() * image.elemSize(),
                             deep ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8, 0);
  }
  if (code != 0) return fail(ErrorCode::invalid_input, "the PNG image cannot be decoded: {}", spng_strerror(code));
  const bool grey =
      header.color_type == SPNG_COLOR_TYPE_GRAYSCALE || header.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA;
  if (grey) {
    cv::extractChannel(image, image, 0);
  } else {
    cv::cvtColor(image, image, cv::COLOR_RGBA2BGR);
  }
  return image;
}

Result<cv::Mat> camera_tiff(std::string_view bytes) {
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  std::istringstream stream{std::string(bytes)};
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(TIFFStreamOpen("image", &stream), TIFFClose);
  if (!file) return fail(ErrorCode::invalid_input, "the TIFF image cannot be decoded: its header is unreadable");
  const auto width = tiff_field<std::uint32_t>(file.get(), TIFFTAG_IMAGEWIDTH);
  const auto height = tiff_field<std::uint32_t>(file.get(), TIFFTAG_IMAGELENGTH);
  const auto bits = tiff_field<std::uint16_t>(file.get(), TIFFTAG_BITSPERSAMPLE);
  const auto samples = tiff_field<std::uint16_t>(file.get(), TIFFTAG_SAMPLESPERPIXEL);
  const bool fits = (bits == 8 || bits == 16) && (samples == 1 || samples == 3 || samples == 4) &&
                    tiff_field<std::uint16_t>(file.get(), TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_UINT &&
                    tiff_field<std::uint16_t>(file.get(), TIFFTAG_PLANARCONFIG) == PLANARCONFIG_CONTIG &&
                    TIFFIsTiled(file.get()) == 0 && is_image_size(width, height);
  if (!fits) {
    return fail(ErrorCode::invalid_input, "the TIFF image is not grey or colour of 8 or 16 bits, in strips");
  }
  cv::Mat image(static_cast<int>(height), static_cast<int>(width), CV_MAKETYPE(bits == 8 ? CV_8U : CV_16U, samples));
  if (TIFFScanlineSize64(file.get()) != image.cols * image.elemSize()) {
    return fail(ErrorCode::invalid_input, "the TIFF image cannot be decoded: its rows have an unknown form");
  }
  for (std::uint32_t y = 0; y < height; ++y) {
    if (TIFFReadScanline(file.get(), image.ptr(static_cast<int>(y)), y, 0) != 1) {
      return fail(ErrorCode::invalid_input, "the TIFF image cannot be decoded: row {} is unreadable", y);
    }
  }
  if (samples > 1) cv::cvtColor(image, image, samples == 3 ? cv::COLOR_RGB2BGR : cv::COLOR_RGBA2BGR);
  return image;
}

}  // namespace

Result<cv::Mat> decode_camera_image(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return camera_png(bytes);
  if (bytes.starts_with("II*") || bytes.starts_with("MM")) return camera_tiff(bytes);
  return fail(ErrorCode::invalid_input, "not a PNG or TIFF image");
}

}  // namespace scanrig
