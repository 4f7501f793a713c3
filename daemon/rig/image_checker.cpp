#include "daemon/rig/image_checker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace scanrig {
namespace {

// Rendered scans of twelve objects. Images with pattern have 0.044 to 0.064 of full scale. Blur is 1.1 to 1.3 px, 2.2
// to 2.6 px when blurred over 9x9 pixels, left_right_correlation at most 0.02. Images of one object differ by
// a tenth.
constexpr double kDarker = 0.4;       ///< of the images before
constexpr double kMoreBlurred = 1.6;  ///< times the blur of the images before

/// NaN where nothing was measured.
double middle(const std::vector<double>& ascending) {
  return ascending.empty() ? std::numeric_limits<double>::quiet_NaN() : ascending[ascending.size() / 2];
}

void insert(std::vector<double>& ascending, double value) {
  if (!std::isnan(value)) ascending.insert(std::ranges::upper_bound(ascending, value), value);
}

const char* name_of(Light light) { return light == Light::pattern ? "pattern" : "plain"; }

}  // namespace

Result<void> ImageChecker::judge(Light light, const StereoFrame& frame) {
  if (auto left = judge(light, "left", frame.left_evidence); !left) return left;
  if (auto right = judge(light, "right", frame.right_evidence); !right) return right;
  if (light == Light::pattern && frame.left_right_correlation > kOneImage) {
    return fail(ErrorCode::protocol,
                "camera: left and right show the same image (left_right_correlation {:.2f}); check the cables and "
                "serial numbers",
                frame.left_right_correlation);
  }
  remember(light, "left", frame.left_evidence);
  remember(light, "right", frame.right_evidence);
  return {};
}

Result<void> ImageChecker::judge(Light light, const char* side, const ImageQuality& evidence) const {
  const auto found = seen_.find({light, side});
  const Seen& seen = found == seen_.end() ? Seen{} : found->second;
  const double usual = middle(seen.brightness), sharp = middle(seen.blur_px);
  // Comparisons with NaN are false.
  if (evidence.brightness < kDarkImage || evidence.brightness < kDarker * usual) {
    return fail(ErrorCode::protocol,
                "{} camera: the {} image is dark ({:.3f} of full scale{}); check light, lens and exposure_us", side,
                name_of(light), evidence.brightness,
                std::isnan(usual) ? "" : fmt::format(", {:.3f} in the views before", usual));
  }
  if (evidence.saturated > kOverexposed) {
    return fail(ErrorCode::protocol,
                "{} camera: the {} image is overexposed ({:.0f} % at full scale); lower exposure_us or gain", side,
                name_of(light), 100.0 * evidence.saturated);
  }
  if (light == Light::pattern && evidence.blur_px > kMoreBlurred * sharp) {
    return fail(
        ErrorCode::protocol,
        "{} camera: the {} image is blurred ({:.1f} px, {:.1f} px in the views before); check focus and vibration",
        side, name_of(light), evidence.blur_px, sharp);
  }
  return {};
}

void ImageChecker::remember(Light light, const char* side, const ImageQuality& evidence) {
  Seen& seen = seen_[{light, side}];
  insert(seen.brightness, evidence.brightness);
  insert(seen.blur_px, evidence.blur_px);
}

}  // namespace scanrig
