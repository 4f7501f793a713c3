#include "pipeline/calibration/watch/watch.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "pipeline/calibration/watch/moved_parts.h"
#include "pipeline/calibration/watch/watch_sentences.h"

namespace scanrig {
namespace {

constexpr double kMeanRadiusMm = 37.0;  // rms over a volume of 55 mm
constexpr double kMeanHeightMm = 57.0;
constexpr double kRowsExpectedPx = 0.003;

/// Root of a mean square of `motion`, and of what its covariance alone would give.
std::pair<double, double> size_of(const PoseMatrix& form, const PartMotion& motion) {
  return {std::sqrt(motion.change.dot(form * motion.change)), std::sqrt((form * motion.covariance).trace())};
}

WatchVerdict judge(const WatchedPart& part, const WatchOptions& options) {
  if (!(part.px > options.min_sigmas * part.expected_px) || !(part.px > options.max_px)) return WatchVerdict::holds;
  const double refused_px = part.part == RigPart::axis ? options.refused_axis_px : options.refused_px;
  return part.px > refused_px ? WatchVerdict::refused : WatchVerdict::moved;
}

WatchedPart camera_part(int camera, const MovedParts& moved, const RigEffects& effects) {
  const PartMotion& motion = moved.camera[camera];
  const auto [px, expected] = size_of(effects.image_px2[camera], motion);
  return {camera == 0 ? RigPart::left_camera : RigPart::right_camera,
          {},
          px,
          kMicrometresPerMm * size_of(effects.volume_mm2, motion).first,
          expected};
}

WatchedPart depth_part(RigPart part, const PartMotion& motion, const RigEffects& effects) {
  const auto [mm, expected] = size_of(effects.volume_mm2, motion);
  return {part, {}, mm / effects.mm_per_px, kMicrometresPerMm * mm, expected / effects.mm_per_px};
}

WatchedPart angle_part(double rms_rad, double sigma_rad, const RigEffects& effects) {
  const double mm = rms_rad * kMeanRadiusMm;
  return {RigPart::angles,
          {},
          mm / effects.mm_per_px,
          kMicrometresPerMm * mm,
          sigma_rad * kMeanRadiusMm / effects.mm_per_px};
}

bool are_dots_seen(const WatchInput& input, const WatchOptions& options) {
  std::array<std::size_t, 2> dots{};
  for (const WatchView& view : input.views) {
    for (std::size_t c = 0; c < 2; ++c) dots[c] += view.dots[c].size();
  }
  return std::ranges::min(dots) >= static_cast<std::size_t>(options.min_dots);
}

void judge_dots(const WatchInput& input, const RigFit& fit, const RigPriors& priors, const WatchOptions& options,
                Watch& watch) {
  const RigEffects effects = rig_effects(input.calibration);
  const MovedParts moved_parts = find_moved_parts(fit, priors);
  watch.parts = {camera_part(0, moved_parts, effects), camera_part(1, moved_parts, effects),
                 depth_part(RigPart::pair, moved_parts.pair, effects),
                 depth_part(RigPart::axis, moved_parts.table, effects)};
  // A view's angle is as good as its dots; its own wobble is the rest.
  constexpr double kAngleExpectedDeg = 0.003;
  watch.parts.push_back(angle_part(fit.angle_rms_rad, to_radians(kAngleExpectedDeg), effects));
  watch.refined = moved(input.calibration, fit.change);
  watch.refined_angles_rad = fit.angles_rad;
  watch.table_zero_deg = to_degrees(fit.angle_offset_rad);
  if (fit.rows > 0) watch.parts.push_back({RigPart::rows, {}, fit.rows_rms_px, 0.0, kRowsExpectedPx});
  for (WatchedPart& part : watch.parts) part.verdict = judge(part, options);
  // The dots measure every angle: one that is off is mended, however far.
  WatchedPart& angles = watch.parts[4];
  if (angles.verdict == WatchVerdict::refused) angles.verdict = WatchVerdict::moved;
  watch.sentences = watch_sentences(watch.parts, moved_parts.table_change, fit.angle_rms_rad);
}

WatchVerdict worst_of(const std::vector<WatchedPart>& parts) {
  WatchVerdict worst = WatchVerdict::not_available;
  for (const WatchedPart& part : parts) worst = std::max(worst, part.verdict);
  return worst;
}

}  // namespace

std::string_view to_string(WatchVerdict verdict) {
  switch (verdict) {
    case WatchVerdict::not_available: return "not available";
    case WatchVerdict::holds: return "holds";
    case WatchVerdict::moved: return "moved";
    case WatchVerdict::refused: return "refused";
  }
  return "";
}

std::string_view to_string(RigPart part) {
  switch (part) {
    case RigPart::left_camera: return "left camera";
    case RigPart::right_camera: return "right camera";
    case RigPart::pair: return "pair";
    case RigPart::rows: return "rows";
    case RigPart::axis: return "axis";
    case RigPart::angles: return "angles";
    case RigPart::overlap: return "overlap";
  }
  return "";
}

Watch watch_rig(const WatchInput& input, const WatchOptions& options) {
  Watch watch;
  if (!input.calibration.quality || input.views.empty()) return watch;
  const RigPriors priors = rig_priors(input.calibration, *input.calibration.quality, options.drift);
  const RigFit fit = fit_rig(input, priors.total());
  watch.dots = fit.dots;
  watch.rows = fit.rows;
  watch.rows_rms_px = fit.rows_rms_px;
  if (are_dots_seen(input, options)) {
    judge_dots(input, fit, priors, options, watch);
  } else if (fit.rows > 0) {
    watch.parts.push_back({RigPart::rows, {}, fit.rows_rms_px, 0.0, kRowsExpectedPx});
    watch.parts.back().verdict = judge(watch.parts.back(), options);
    watch.sentences = watch_sentences(watch.parts, TableChange::Zero(), 0.0);
  }
  watch.verdict = worst_of(watch.parts);
  return watch;
}

void add_overlap(Watch& watch, const Calibration& calibration, double axis_tilt_deg, double axis_shift_mm,
                 const WatchOptions& options) {
  if (!calibration.quality) return;
  const double mm = std::hypot(axis_shift_mm, to_radians(axis_tilt_deg) * kMeanHeightMm);
  const AxisSigma sigma = axis_sigma(calibration, *calibration.quality);
  const double mm_per_px = rig_effects(calibration).mm_per_px;
  WatchedPart part{RigPart::overlap, WatchVerdict::holds, mm / mm_per_px, kMicrometresPerMm * mm,
                   std::hypot(sigma.shift_mm, to_radians(sigma.tilt_deg) * kMeanHeightMm) / mm_per_px};
  if (part.px > options.overlap_px && part.px > options.min_sigmas * part.expected_px) {
    part.verdict = WatchVerdict::moved;
    watch.sentences.push_back(overlap_sentence(axis_tilt_deg, axis_shift_mm));
  }
  watch.parts.push_back(part);
  watch.verdict = worst_of(watch.parts);
}

}  // namespace scanrig
