#pragma once

#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

/// Uncertainty of each part of the calibration (standard deviations), and parameters of the search.
struct RegistrationOptions {
  double angle_sigma_deg = 0.01;       ///< of each table angle: the stepper
  double rotation_sigma_deg = 0.002;   ///< of each view by itself: vibration
  double translation_sigma_mm = 0.01;  ///< of each view by itself
  double axis_tilt_sigma_deg = 0.002;  ///< of the turntable axis, common to all views; 0: not solved for
  double axis_shift_sigma_mm = 0.005;  ///< the same, its position
  double pair_bias_mm = 0.01;          ///< error of two views' mean distance that more points do not average away
  double capture_mm = 1.0;             ///< farthest distance between corresponding surfaces at the start
  double min_facing = 0.5;             ///< cosine of incidence below which a point is not used: stereo is biased there
  int neighbours = 2;                  ///< views up to this many places away around the ring are compared; 0: every
                                       ///< two views that share `min_shared_share`, where there is no ring
  double min_shared_share = 0.05;      ///< of a view's points, for that
  int samples = 20000;                 ///< points per view at the finest level, a quarter of it at each coarser one
  int levels = 3;
  int max_iterations = 12;       ///< maximum Gauss-Newton steps per level
  double settled_mm = 3e-4;      ///< motion of the surface that ends the iteration
  double arm_mm = 50.0;          ///< from the axis to the surface, roughly: converts rotations into this motion
  double min_agreement = 0.7;    ///< cosine between corresponding normals
  double robust_scale = 1.5;     ///< scale of the robust weight, in standard deviations of the residuals
  double min_leverage = 0.02;    ///< slope of the surface along the turn below which table angles are held
  std::size_t min_shared = 100;  ///< points of a view, and points that two neighbours must share

  /// For imported range scans whose views were placed elsewhere, to a millimetre and half a degree.
  static RegistrationOptions imported();
  /// The same for views that no turntable turned.
  static RegistrationOptions placed();
};

/// Correction of one view and its fit to its neighbours afterwards.
struct ViewFit {
  int index = 0;
  double angle_correction_deg = 0.0;                         ///< the table angle's part of the correction
  Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();    ///< the view's own part, pose frame
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();  ///< the same
  double median_before_mm = 0.0, median_after_mm = 0.0;      ///< of |point to plane|, untrimmed; NaN without overlap
  double rms_before_mm = 0.0, rms_after_mm = 0.0;
  double overlap = 0.0;  ///< share of its points that a neighbour also sees
};

struct RegistrationReport {
  std::vector<ViewFit> views;
  double axis_tilt_deg = 0.0;  ///< correction of the axis that all views share
  double axis_shift_mm = 0.0;
  /// False for a body of revolution: its table angles could not be measured and stay as the stepper reported them.
  bool angle_observable = true;
  double angle_leverage =
      0.0;  ///< rms slope of the surface along the turn, 0 for a body of revolution; < 0.02 is insufficient
  double median_before_mm = 0.0, median_after_mm = 0.0;
};

/// Moves the views of one pose, silhouettes included, onto each other: least squares over the table angles, the axis
/// and small rigid corrections, all held by the priors of `options`; point to plane between neighbours around the
/// closed ring [Park and Subbarao 2002; 2003 for the correspondences]. The pose's frame stays where it is. Same bits
/// for any number of threads. A single view is returned unchanged.
/// Fails with `invalid_input` (maps of a view differ in size), `degenerate` (no view has 100 measured points),
/// `no_overlap` (no two views share 100 points), `stopped`; the views are then unchanged.
Result<RegistrationReport> register_views(std::span<View> views, const RegistrationOptions& options,
                                          const Context& context);

}  // namespace scanrig
