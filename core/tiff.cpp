#include <tiffio.h>
#include <tiffio.hxx>

#include <memory>
#include <sstream>

#include "core/image_codec.h"
#include "core/tiff_field.h"

namespace scanrig {
namespace {

using File = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

/// Errors are reported in a Result, not on the terminal.
void be_quiet() {
  static const bool once = [] {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    return true;
  }();
  static_cast<void>(once);
}

bool write(TIFF* file, const cv::Mat1f& depth) {
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, depth.cols);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, depth.rows);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, depth.rows);
  bool written = true;
  cv::Mat1f row;
  for (int y = 0; y < depth.rows && written; ++y) {
    depth.row(y).copyTo(row);
    written = TIFFWriteScanline(file, row.data, static_cast<std::uint32_t>(y), 0) == 1;
  }
  return written;
}

}  // namespace

Result<std::vector<std::byte>> encode_tiff(const cv::Mat1f& depth) {
  be_quiet();
  std::ostringstream bytes;
  File file(depth.empty() ? nullptr : TIFFStreamOpen("depth", &bytes), TIFFClose);
  const bool written = file && write(file.get(), depth);
  file.reset();  // writes the directory
  if (!written) return fail(ErrorCode::invalid_input, "the image cannot be encoded as TIFF");
  const std::string text = bytes.str();
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return std::vector<std::byte>(begin, begin + text.size());
}

Result<cv::Mat> decode_tiff(std::string_view bytes) {
  be_quiet();
  std::istringstream stream{std::string(bytes)};
  const File file(TIFFStreamOpen("depth", &stream), TIFFClose);
  if (!file) return fail(ErrorCode::invalid_input, "the TIFF image cannot be decoded: its header is unreadable");
  const auto width = tiff_field<std::uint32_t>(file.get(), TIFFTAG_IMAGEWIDTH);
  const auto height = tiff_field<std::uint32_t>(file.get(), TIFFTAG_IMAGELENGTH);
  const bool fits = tiff_field<std::uint16_t>(file.get(), TIFFTAG_BITSPERSAMPLE) == 32 &&
                    tiff_field<std::uint16_t>(file.get(), TIFFTAG_SAMPLESPERPIXEL) == 1 &&
                    tiff_field<std::uint16_t>(file.get(), TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_IEEEFP &&
                    TIFFIsTiled(file.get()) == 0 && is_image_size(width, height);
  if (!fits) return fail(ErrorCode::invalid_input, "the TIFF image is not 32-bit float depth");
  cv::Mat1f depth(static_cast<int>(height), static_cast<int>(width));
  for (std::uint32_t y = 0; y < height; ++y) {
    if (TIFFReadScanline(file.get(), depth.ptr(static_cast<int>(y)), y, 0) != 1) {
      return fail(ErrorCode::invalid_input, "the TIFF image cannot be decoded: row {} is unreadable", y);
    }
  }
  return cv::Mat(depth);
}

}  // namespace scanrig
