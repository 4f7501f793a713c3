#include "pipeline/storage/images.h"

#include <opencv2/imgproc.hpp>

#include "core/units.h"
#include "pipeline/exposures/merge_exposures.h"

namespace scanrig {
namespace {

cv::Mat demosaiced(const cv::Mat& image, const std::string& pixel_format) {
  if (pixel_format != "BayerRG8") return image;
  cv::Mat bgr;
  // OpenCV names a pattern by the pixels at (1,1) and (1,2), GenICam by those at (0,0) and (0,1).
  cv::cvtColor(image, bgr, cv::COLOR_BayerBG2BGR_EA);
  return bgr;
}

Result<void> check_image(const std::string& name, const cv::Mat& image, const std::string& pixel_format) {
  const bool is_format = pixel_format == "Mono8" || pixel_format == "BayerRG8" || pixel_format == "BGR8";
  if (!is_format) return fail(ErrorCode::invalid_input, "unknown pixel format \"{}\"", pixel_format);
  if (image.empty()) return fail(ErrorCode::invalid_input, "{}: the image is missing", name);
  if (image.type() != (pixel_format == "BGR8" ? CV_8UC3 : CV_8UC1)) {
    return fail(ErrorCode::invalid_input, "{}: {} channels of {} bytes are not {}", name, image.channels(),
                image.elemSize1(), pixel_format);
  }
  return {};
}

/// All exposures of one side as one image.
cv::Mat merged_pattern(const RawView& raw, bool is_left) {
  const cv::Mat& first = is_left ? raw.left_pattern : raw.right_pattern;
  if (raw.more_patterns.empty()) return demosaiced(first, raw.pixel_format);
  std::vector<OtherExposure> more;
  for (const PatternExposure& one : raw.more_patterns) more.push_back({is_left ? one.left : one.right, one.factor});
  return demosaiced(merge_exposures(first, more, NoiseModel{}), raw.pixel_format);
}

}  // namespace

cv::Mat& RawView::image(std::string_view role) {
  const bool left = role.starts_with("left");
  if (role.ends_with("pattern")) return left ? left_pattern : right_pattern;
  return left ? left_plain : right_plain;
}

const cv::Mat& RawView::image(std::string_view role) const { return const_cast<RawView*>(this)->image(role); }

Result<void> check_images(const RawView& raw, std::string_view source) {
  for (const auto& role : view_roles(source)) {
    if (const auto checked = check_image(role, raw.image(role), raw.pixel_format); !checked) return checked;
  }
  if (source == "calibration") return {};
  if (raw.left_pattern.size() != raw.left_plain.size() || raw.right_pattern.size() != raw.right_plain.size()) {
    return fail(ErrorCode::invalid_input, "the pattern and the plain image of a camera differ in size");
  }
  for (const PatternExposure& more : raw.more_patterns) {
    const auto [left, right] = pattern_roles(more.factor);
    if (const auto checked = check_image(left, more.left, raw.pixel_format); !checked) return checked;
    if (const auto checked = check_image(right, more.right, raw.pixel_format); !checked) return checked;
    if (more.left.size() != raw.left_pattern.size() || more.right.size() != raw.right_pattern.size()) {
      return fail(ErrorCode::invalid_input, "{} or {}: an exposure differs in size from the first", left, right);
    }
  }
  return {};
}

Result<cv::Mat> to_usable_image(const cv::Mat& raw, const std::string& pixel_format) {
  if (const auto checked = check_image("image", raw, pixel_format); !checked) return pass_on(checked);
  try {
    return demosaiced(raw, pixel_format);
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::invalid_input, "the image cannot be demosaiced: {}", e.what());
  }
}

Result<ViewImages> to_view_images(const RawView& raw, const ViewRecord& record) {
  if (const auto checked = check_images(raw); !checked) return pass_on(checked);
  try {
    ViewImages images;
    images.index = record.index;
    images.angle_rad = to_radians(record.measured_deg);
    images.left_pattern = merged_pattern(raw, true);
    images.right_pattern = merged_pattern(raw, false);
    images.left_plain = demosaiced(raw.left_plain, raw.pixel_format);
    images.right_plain = demosaiced(raw.right_plain, raw.pixel_format);
    return images;
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::invalid_input, "the images cannot be demosaiced: {}", e.what());
  }
}

}  // namespace scanrig
