#include "pipeline/calibration/watch/watch_sentences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace scanrig {
namespace {

bool has_moved(const WatchedPart& part) {
  return part.verdict == WatchVerdict::moved || part.verdict == WatchVerdict::refused;
}

std::string sentence(const WatchedPart& part, const TableChange& table, double angle_rms_rad) {
  switch (part.part) {
    case RigPart::left_camera:
      return fmt::format("Left camera moved by {:.2f} px: clamp it, calibrate again.", part.px);
    case RigPart::right_camera:
      return fmt::format("Right camera moved by {:.2f} px: clamp it, calibrate again.", part.px);
    case RigPart::pair:
      return fmt::format("Cameras moved against each other by {:.2f} px: clamp both, calibrate again.", part.px);
    case RigPart::rows:
      return fmt::format("Rows of the cameras differ by {:.2f} px: clamp both cameras, calibrate again.", part.px);
    case RigPart::axis:
      return fmt::format("Table axis moved by {:.2f} mm, {:.3f} deg: fix table and camera mount, calibrate again.",
                         std::hypot(table[0], table[2]), to_degrees(table.tail<2>().norm()));
    case RigPart::angles:
      return fmt::format("Table angles off by {:.3f} deg: check gear ratio and drive.", to_degrees(angle_rms_rad));
    case RigPart::overlap: break;
  }
  return {};
}

}  // namespace

std::vector<std::string> watch_sentences(const std::vector<WatchedPart>& parts, const TableChange& table,
                                         double angle_rms_rad) {
  std::vector<WatchedPart> said;
  const auto is_said = [&](RigPart part) {
    return std::ranges::any_of(parts, [&](const WatchedPart& p) { return p.part == part && has_moved(p); });
  };
  const bool is_camera_named = is_said(RigPart::left_camera) || is_said(RigPart::right_camera);
  for (const WatchedPart& part : parts) {
    if (!has_moved(part)) continue;
    // A camera that is named explains these; "against each other" explains rows.
    if (part.part == RigPart::pair && is_camera_named) continue;
    if (part.part == RigPart::rows && (is_camera_named || is_said(RigPart::pair))) continue;
    said.push_back(part);
  }
  std::ranges::stable_sort(said, [](const WatchedPart& a, const WatchedPart& b) { return a.px > b.px; });
  std::vector<std::string> sentences;
  for (const WatchedPart& part : said) sentences.push_back(sentence(part, table, angle_rms_rad));
  return sentences;
}

std::string overlap_sentence(double axis_tilt_deg, double axis_shift_mm) {
  return fmt::format("Views fit with the axis moved by {:.2f} mm, {:.3f} deg only: calibrate again.", axis_shift_mm,
                     axis_tilt_deg);
}

}  // namespace scanrig
