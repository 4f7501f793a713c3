#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "pipeline/storage/manifest.h"

namespace scanrig {

/// One more exposure of the pattern, `factor` times as long as the first.
struct PatternExposure {
  double factor = 1.0;
  cv::Mat left, right;
};

/// The images of a view, as delivered by the sensors. A view of a calibration has no pattern images.
struct RawView {
  std::string pixel_format;
  cv::Mat left_pattern, right_pattern, left_plain, right_plain;
  std::vector<PatternExposure> more_patterns{};  ///< in the order of ViewRecord::pattern_factors

  /// "left_plain" and so on, as view_roles() names them.
  [[nodiscard]] cv::Mat& image(std::string_view role);
  [[nodiscard]] const cv::Mat& image(std::string_view role) const;
};

/// The four images of a view, ready for use: BGR (colour sensors, demosaiced) or grey (mono sensors), 8 bit. Several
/// exposures of the pattern have become one image of 16 bit for each side, see merge_exposures().
struct ViewImages {
  int index = 0;
  double angle_rad = 0.0;  ///< table angle as measured
  cv::Mat left_pattern, right_pattern, left_plain, right_plain;
};

/// Merges exposures, demosaics where needed. Fails with `invalid_input` for an unknown format or inconsistent sizes.
Result<ViewImages> to_view_images(const RawView& raw, const ViewRecord& record);

/// One image of a sensor, ready for use: demosaiced where its pixel format needs it. Fails with `invalid_input`.
Result<cv::Mat> to_usable_image(const cv::Mat& raw, const std::string& pixel_format);

/// Checks that every image of such a source is 8 bit and has the format's channels, and that left and right each have
/// one size, in all exposures. Fails with `invalid_input`.
Result<void> check_images(const RawView& raw, std::string_view source = "stereo");

}  // namespace scanrig
