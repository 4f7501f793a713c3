#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/watch/watch.h"
#include "pipeline/range/range_image.h"
#include "pipeline/range/retriangulate.h"
#include "pipeline/registration/pose_uncertainty.h"
#include "pipeline/registration/register_views.h"
#include "pipeline/storage/images.h"

namespace scanrig {

enum class WatchMode {
  off,     ///< nothing is measured
  report,  ///< measured and reported; the calibration is used as it is
  refine   ///< refined when a part has moved; no model when it has moved too far
};
/// Fails with `invalid_input`: none of "off", "report", "refine".
Result<WatchMode> watch_mode_of(const std::string& name);

/// The watch over one pose of a stereo scan: views are measured as they come, judged when the pose is complete.
/// Threads: one user at a time; work inside is spread over the current arena.
class RigWatch {
 public:
  /// Both must live as long as this object.
  RigWatch(const Calibration& calibration, const Rectification& rectification);

  /// Rim dots in the plain images, row offsets of the match. Dots on or near the object's outline are left out.
  void add(const ViewImages& images, const View& view);
  /// Judges the views added, and refines them in `refine`. Fails with `below_limits` when a part has moved too far;
  /// the message is for the operator.
  Result<void> judge(std::span<View> views, WatchMode mode);
  /// Brings view `v`, made anew after judge(), to the refined rig.
  void carry(View& view, std::size_t v) const;
  void add_overlap(const RegistrationReport& registration);

  [[nodiscard]] const Watch& result() const { return result_; }
  [[nodiscard]] bool is_refined() const { return frames_.has_value(); }
  /// Cameras and rectified frames that hold for the pose's views: refined, or as calibrated.
  [[nodiscard]] const Calibration& calibration() const { return is_refined() ? *result_.refined : calibration_; }
  [[nodiscard]] Transform left_from_turntable() const;

 private:
  [[nodiscard]] std::vector<DotObservation> find_dots(const cv::Mat& plain, const View& view, double angle_rad,
                                                      std::size_t camera) const;

  const Calibration& calibration_;
  const Rectification& rectification_;
  std::vector<WatchView> views_;
  Watch result_;
  std::optional<MovedFrames> frames_;
};

/// Registration's uncertainties: how well the calibration knows the axis, beside what axes drift by. A calibration of
/// unknown quality: drift alone.
RegistrationOptions registration_options(const Calibration& calibration);

/// What the calibration's covariance lets expect of points of range images whose frame is `left_from_turntable`; empty
/// without one. Keeps a copy of the calibration.
CalibrationModes calibration_modes(const Calibration& calibration, const Transform& left_from_turntable);

}  // namespace scanrig
