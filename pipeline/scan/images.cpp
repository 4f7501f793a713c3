#include "pipeline/scan/images.h"

#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/units.h"

namespace scanrig {
namespace {

std::array<std::pair<const char*, const cv::Mat*>, 4> named(const RawView& raw) {
  return {{{"left_pattern", &raw.left_pattern},
           {"right_pattern", &raw.right_pattern},
           {"left_plain", &raw.left_plain},
           {"right_plain", &raw.right_plain}}};
}

Result<std::vector<std::byte>> encode(const char* extension, const cv::Mat& image, const std::vector<int>& options) {
  try {
    std::vector<uchar> bytes;
    if (!image.empty() && cv::imencode(extension, image, bytes, options)) {
      const auto* data = reinterpret_cast<const std::byte*>(bytes.data());
      return std::vector<std::byte>(data, data + bytes.size());
    }
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::invalid_input, "the image cannot be encoded as {}: {}", extension, e.what());
  }
  return fail(ErrorCode::invalid_input, "the image cannot be encoded as {}", extension);
}

cv::Mat demosaiced(const cv::Mat& image, const std::string& pixel_format) {
  if (pixel_format != "BayerRG8") return image;
  cv::Mat bgr;
  // OpenCV names a pattern by the pixels at (1,1) and (1,2), GenICam by those at (0,0) and (0,1).
  cv::cvtColor(image, bgr, cv::COLOR_BayerBG2BGR_EA);
  return bgr;
}

/// Whether the bytes begin as a PNG image does and end before its IEND chunk (PNG specification, 5.3): libpng would
/// write about it to the terminal.
bool is_cut_png(std::string_view bytes) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
  constexpr std::size_t kLength = 4, kType = 4, kCrc = 4;
  if (!bytes.starts_with(kSignature)) return false;
  for (std::size_t at = kSignature.size(); at + kLength + kType <= bytes.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < kLength; ++i) length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
    const auto type = bytes.substr(at + kLength, kType);
    at += kLength + kType + length + kCrc;
    if (type == "IEND") return at > bytes.size();
  }
  return true;
}

}  // namespace

Result<void> check_images(const RawView& raw) {
  const bool known = raw.pixel_format == "Mono8" || raw.pixel_format == "BayerRG8" || raw.pixel_format == "BGR8";
  if (!known) return fail(ErrorCode::invalid_input, "unknown pixel format \"{}\"", raw.pixel_format);
  const int type = raw.pixel_format == "BGR8" ? CV_8UC3 : CV_8UC1;
  for (const auto& [name, image] : named(raw)) {
    if (image->empty()) return fail(ErrorCode::invalid_input, "{}: there is no image", name);
    if (image->type() != type) {
      return fail(ErrorCode::invalid_input, "{}: {} channels of {} bytes do not make {}", name, image->channels(),
                  image->elemSize1(), raw.pixel_format);
    }
  }
  if (raw.left_pattern.size() != raw.left_plain.size() || raw.right_pattern.size() != raw.right_plain.size()) {
    return fail(ErrorCode::invalid_input, "the pattern and the plain image of a camera differ in size");
  }
  return {};
}

Result<ViewImages> to_view_images(const RawView& raw, const ViewRecord& record) {
  if (const auto checked = check_images(raw); !checked) return pass_on(checked);
  try {
    ViewImages images;
    images.index = record.index;
    images.angle_rad = to_radians(record.measured_deg);
    images.left_pattern = demosaiced(raw.left_pattern, raw.pixel_format);
    images.right_pattern = demosaiced(raw.right_pattern, raw.pixel_format);
    images.left_plain = demosaiced(raw.left_plain, raw.pixel_format);
    images.right_plain = demosaiced(raw.right_plain, raw.pixel_format);
    return images;
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::invalid_input, "the images cannot be demosaiced: {}", e.what());
  }
}

Result<std::vector<std::byte>> encode_png(const cv::Mat& image) {
  return encode(".png", image, {cv::IMWRITE_PNG_COMPRESSION, 1});
}

Result<std::vector<std::byte>> encode_tiff(const cv::Mat1f& depth) {
  return encode(".tiff", depth, {cv::IMWRITE_TIFF_COMPRESSION, 1});
}

Result<cv::Mat> decode_image(std::string_view bytes) {
  if (is_cut_png(bytes)) return fail(ErrorCode::invalid_input, "a PNG image of which the end is missing");
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
    cv::Mat image = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
    if (!image.empty()) return image;
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::invalid_input, "not a readable image: {}", e.what());
  }
  return fail(ErrorCode::invalid_input, "not a readable image");
}

}  // namespace scanrig
