#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/calibration/watch/rig_fit.h"
#include "pipeline/calibration/watch/rig_priors.h"

namespace scanrig {

enum class WatchVerdict {
  not_available,  ///< not measured
  holds,
  moved,    ///< said, and refined
  refused,  ///< no model from this calibration
};
std::string_view to_string(WatchVerdict verdict);

/// What is watched.
enum class RigPart {
  left_camera,
  right_camera,
  pair,     ///< one camera against the other, by what it does to depth
  rows,     ///< the cameras' rows against each other, by matching
  axis,     ///< table and axis against both cameras
  angles,   ///< of the table, beside a common zero
  overlap,  ///< of neighbouring views; judged by add_overlap(), never refused
};
std::string_view to_string(RigPart part);

/// Departure of one part from the calibration.
struct WatchedPart {
  RigPart part = RigPart::left_camera;
  WatchVerdict verdict = WatchVerdict::not_available;
  double px = 0.0;         ///< mean shift of the image; of pair, axis, angles: the disparity that does as much to depth
  double volume_um = 0.0;  ///< rms shift of points of the working volume
  double expected_px = 0.0;  ///< one sigma without a departure: noise of this scan and the calibration's covariance
};

struct WatchOptions {
  double max_px = 0.04;          ///< above, the part has moved: said, and the calibration refined
  double refused_px = 0.15;      ///< above, refused
  double refused_axis_px = 1.0;  ///< of the axis: matching does not depend on it, and the dots measure it
  double min_sigmas = 3.0;       ///< less is what an untouched rig shows
  double overlap_px = 0.1;  ///< overlap cannot tell the axis from stereo's error at incidence: said above this only
  int min_dots = 12;        ///< per camera, in all views of a pose
  RigDrift drift{};
};

/// Result of the watch over one pose.
struct Watch {
  WatchVerdict verdict = WatchVerdict::not_available;  ///< the worst of the parts
  std::vector<WatchedPart> parts;
  std::vector<std::string> sentences;  ///< for the operator: what moved, by how much, what to do
  std::array<int, 2> dots{};           ///< used per camera
  int rows = 0;                        ///< row offsets used
  double rows_rms_px = 0.0;
  double table_zero_deg = 0.0;  ///< true minus reported angle, common to all views; turns the model, nothing else
  /// Both cameras and the views' true angles by dots and rows; present when dots were measured. To be used when
  /// `verdict` is `moved`: below, it adds more noise than it mends.
  std::optional<Calibration> refined;
  std::vector<double> refined_angles_rad;
};

/// Compares what one pose of a scan shows with its calibration. Without a quality (version 1): not available. Without
/// dots, rows alone are judged. Threads: any. Same input, same bits.
Watch watch_rig(const WatchInput& input, const WatchOptions& options = {});

/// Adds what registering the pose's views found of the axis: tilt in degrees, shift in mm at the table top.
void add_overlap(Watch& watch, const Calibration& calibration, double axis_tilt_deg, double axis_shift_mm,
                 const WatchOptions& options = {});

}  // namespace scanrig
