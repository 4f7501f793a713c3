#include <turbojpeg.h>

#include <memory>

#include "core/image_codec.h"

namespace scanrig {
namespace {

struct Close {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, Close>;

struct Release {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

/// Cameras pad between markers, which does no harm; other warnings of libjpeg leave a region of the image grey.
bool is_harmless(std::string_view warning) { return warning.find("extraneous bytes") != std::string_view::npos; }

}  // namespace

Result<std::vector<std::byte>> encode_jpeg(const cv::Mat& image, int quality) {
  const bool fits = image.type() == CV_8UC1 || image.type() == CV_8UC3;
  if (image.empty() || !fits) {
    return fail(ErrorCode::invalid_input, "the image cannot be encoded as JPEG: it is not 8 bit grey or BGR");
  }
  const bool grey = image.channels() == 1;
  const Handle handle(tjInitCompress());
  unsigned char* made = nullptr;
  unsigned long size = 0;
  const int code = tjCompress2(handle.get(), image.data, image.cols, static_cast<int>(image.step), image.rows,
                               grey ? TJPF_GRAY : TJPF_BGR, &made, &size, grey ? TJSAMP_GRAY : TJSAMP_420, quality, 0);
  const std::unique_ptr<unsigned char, Release> file(made);
  if (code != 0) {
    return fail(ErrorCode::invalid_input, "the image cannot be encoded as JPEG: {}", tjGetErrorStr2(handle.get()));
  }
  const auto* bytes = reinterpret_cast<const std::byte*>(file.get());
  return std::vector<std::byte>(bytes, bytes + size);
}

Result<cv::Mat> decode_jpeg(std::string_view bytes) {
  const Handle handle(tjInitDecompress());
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const auto complaint = [&] {
    return fail(ErrorCode::invalid_input, "the JPEG image cannot be decoded: {}", tjGetErrorStr2(handle.get()));
  };
  int width = 0, height = 0, sampling = 0, colours = 0;
  if (tjDecompressHeader3(handle.get(), data, bytes.size(), &width, &height, &sampling, &colours) != 0) {
    return complaint();
  }
  if (!is_image_size(static_cast<unsigned>(width), static_cast<unsigned>(height))) {
    return fail(ErrorCode::invalid_input, "the JPEG image cannot be decoded: {}x{} is too large", width, height);
  }
  cv::Mat3b image(height, width);
  const int code = tjDecompress2(handle.get(), data, bytes.size(), image.data, width, static_cast<int>(image.step),
                                 height, TJPF_BGR, 0);
  if (code != 0 && !is_harmless(tjGetErrorStr2(handle.get()))) return complaint();
  return image;
}

}  // namespace scanrig
