#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/rig/image_checker.h"
#include "drivers/camera/image_quality.h"

namespace scanrig::ctl::doctor {
namespace {

// Rendered views: pattern 0.05, plain light 0.14 of full scale, steady to 0.001; texture of the pattern, relative to
// its light, 4.9 to 5.7 times that of plain light; blur equal to 0.02 px, 2.5 times more when blurred over 9x9 pixels.
constexpr double kStaysOn = 0.7;       ///< of the plain light, while it is off
constexpr double kRoom = 0.1;          ///< likewise: it weakens the pattern
constexpr double kMoreTexture = 1.5;   ///< of the pattern against plain light
constexpr double kFocus = 1.4;         ///< blur of one side against the other
constexpr double kUnstable = 0.03;     ///< share by which the light may change
constexpr std::size_t kMinSeries = 8;  ///< exposures to judge that by

constexpr std::array kSides{"left", "right"};

std::string per_cent(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

/// Light on both sides, left first, as shares of full scale; NaN: no image.
using Levels = std::array<double, 2>;

Levels brightness_of(const StereoFrame& frame) {
  return {frame.left_evidence.brightness, frame.right_evidence.brightness};
}

/// What a light adds to what is there without it.
Levels added(const Levels& lit, const Levels& off) {
  const auto without = [](double level) { return std::isnan(level) ? 0.0 : level; };
  return {lit[0] - without(off[0]), lit[1] - without(off[1])};
}

bool is_dark(const Levels& levels) { return levels[0] < kDarkImage && levels[1] < kDarkImage; }
bool is_measured(const Levels& levels) { return !std::isnan(levels[0]) && !std::isnan(levels[1]); }

void note_levels(const TrialImages& images, Report& report) {
  for (const auto& [what, frame] :
       {std::pair("off", &images.off), std::pair("pattern", &images.pattern), std::pair("plain", &images.plain)}) {
    if (frame->left.empty()) continue;
    const auto &left = frame->left_evidence, &right = frame->right_evidence;
    report.note(fmt::format("light {}: left {}, right {} of full scale; blur {:.2f} and {:.2f} px", what,
                            per_cent(left.brightness), per_cent(right.brightness), left.blur_px, right.blur_px));
  }
}

/// The light while it is off. Returns whether the other lights can be judged.
bool judge_off(const Levels& off, const Levels& plain, Report& report) {
  const double level = std::max(off[0], off[1]);
  if (!is_measured(off) || level < kDarkImage) return true;
  if (is_measured(plain) && level > kStaysOn * std::max(plain[0], plain[1])) {
    report.find("light_stays_on",
                fmt::format("With the light switched off the images have {} of full scale, in plain light {}.",
                            per_cent(level), per_cent(std::max(plain[0], plain[1]))),
                "The light is on all the time: check its relay, its line and `active`; a rig whose light cannot be "
                "switched has driver = \"manual\".");
    return false;
  }
  if (!is_measured(plain) || level < kRoom * std::max(plain[0], plain[1])) return true;
  report.find("room_light",
              fmt::format("With the light switched off the images still have {} of full scale.", per_cent(level)),
              "Keep daylight and room light away: close the hood, or lower exposure_us and use a brighter lamp.");
  return true;
}

/// Whether each light arrives at each camera. Returns whether it does.
bool judge_lit(const Levels& pattern, const Levels& plain, Report& report) {
  if (is_dark(pattern) && (!is_measured(plain) || is_dark(plain))) {
    report.find("no_light", "The cameras are triggered, but neither sees any light.",
                "Check the lamp's power, its fuse and the wire from the line to the lamp.");
    return false;
  }
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    const auto is_alone = [&](const Levels& levels) { return levels[i] < kDarkImage && levels[1 - i] >= kDarkImage; };
    if (!is_alone(pattern) && !is_alone(plain)) continue;
    report.find("dark_camera", fmt::format("The {} camera sees no light, the {} one does.", kSides[i], kSides[1 - i]),
                "Take its lens cap off, open its aperture, check its trigger delay and that the light reaches what it "
                "sees.");
    return false;
  }
  if (is_dark(pattern) || is_dark(plain)) {
    const bool is_pattern = is_dark(pattern);
    report.find(is_pattern ? "no_pattern" : "no_plain_light",
                fmt::format("The cameras see no light in {} exposures.", is_pattern ? "pattern" : "plain"),
                fmt::format("Check that lamp and its line: {} in [projector].", is_pattern ? "line" : "plain_line"));
    return false;
  }
  return true;
}

bool judge_saturation(const TrialImages& images, Report& report) {
  for (const auto& [what, frame] : {std::pair("pattern", &images.pattern), std::pair("plain", &images.plain)}) {
    const std::array shares{frame->left_evidence.saturated, frame->right_evidence.saturated};
    for (std::size_t i = 0; i < kSides.size(); ++i) {
      if (!(shares[i] > kOverexposed)) continue;
      report.find("overexposed",
                  fmt::format("The {} camera's {} image has {} of its pixels at full scale.", kSides[i], what,
                              per_cent(shares[i])),
                  "Lower exposure_us or gain, close the aperture, or dim that lamp.");
      return false;
    }
  }
  return true;
}

/// Fine texture of the pattern's own light against that of plain light. Returns whether there is a pattern.
bool judge_pattern(const TrialImages& images, const Levels& pattern, const Levels& plain, Report& report) {
  if (!is_measured(plain)) return true;
  const auto ratio = [&](const cv::Mat& lit, const cv::Mat& even, std::size_t i) {
    return texture(lit, images.pattern.format) / pattern[i] / (texture(even, images.plain.format) / plain[i]);
  };
  const double more =
      std::max(ratio(images.pattern.left, images.plain.left, 0), ratio(images.pattern.right, images.plain.right, 1));
  report.note(fmt::format("pattern: its fine texture is {:.1f} times that of plain light", more));
  if (more >= kMoreTexture) return true;
  if (more < 1.0 / kMoreTexture) {
    report.find("lights_exchanged", "Plain exposures show the pattern, and pattern exposures do not.",
                "Exchange line and plain_line in [projector], or the lamps' wires.");
  } else {
    report.find(
        "no_pattern", "Pattern exposures show no pattern: their fine texture is that of plain light.",
        "Put the slide into the projector, focus it on the part, and check that line fires the pattern's lamp.");
  }
  return false;
}

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// The light of one series: the last quarter against the first, and the whole against its mean.
void judge_stability(const TrialImages& images, Report& report) {
  for (const auto& [what, sides] :
       {std::pair("pattern", &images.brightness[0]), std::pair("plain", &images.brightness[1])}) {
    const std::span<const double> series(sides->first);
    if (series.size() < kMinSeries) continue;
    const std::size_t quarter = series.size() / 4;
    const double drift = mean_of(series.last(quarter)) / mean_of(series.first(quarter)) - 1.0;
    const auto [low, high] = std::ranges::minmax_element(series);
    const double spread = (*high - *low) / mean_of(series);
    report.note(fmt::format("{} light: {:+.1f} % from the first to the last quarter, spread {:.1f} %", what,
                            100 * drift, 100 * spread));
    if (!(std::abs(drift) > kUnstable || spread > 2.0 * kUnstable)) continue;
    return report.find("light_unstable",
                       fmt::format("The {} light changes by {:+.1f} % during the trial, exposures differ by {:.1f} %.",
                                   what, 100 * drift, 100 * spread),
                       "Let the projector warm up and set warm_up_s to that time; check the lamp's supply, and that "
                       "the pulse is longer than the exposure.");
  }
}

/// Returns whether both sides are equally sharp.
bool judge_focus(const TrialImages& images, Report& report) {
  const double left = images.pattern.left_evidence.blur_px, right = images.pattern.right_evidence.blur_px;
  if (!(std::max(left, right) > kFocus * std::min(left, right))) return true;
  report.find("focus_difference",
              fmt::format("The {} camera's image is blurred by {:.1f} px, the other one by {:.1f} px.",
                          left > right ? "left" : "right", std::max(left, right), std::min(left, right)),
              "Focus and lock that lens: scanrig camera tune shows the blur. Then calibrate.");
  return false;
}

}  // namespace

bool judge_images(const TrialImages& images, Report& report) {
  note_levels(images, report);
  const Levels off = brightness_of(images.off), plain = brightness_of(images.plain);
  const Levels pattern_light = added(brightness_of(images.pattern), off), plain_light = added(plain, off);
  if (!judge_off(off, plain, report) || !judge_lit(pattern_light, plain_light, report)) return false;
  if (!judge_saturation(images, report)) return false;
  judge_stability(images, report);
  if (!judge_pattern(images, pattern_light, plain_light, report)) return false;
  if (images.pattern.left_right_correlation > kOneImage) {
    report.find("same_image", "Left and right camera show the same image.",
                "Two connections lead to one camera: correct serial and address of left and right.");
    return false;
  }
  return judge_focus(images, report);
}

}  // namespace scanrig::ctl::doctor
