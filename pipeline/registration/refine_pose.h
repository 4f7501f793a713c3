#pragma once

#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/registration/pose_uncertainty.h"
#include "pipeline/registration/range_surface.h"

namespace scanrig {

/// A plane of pose 1 that a point of pose 2 touches: a table top. It decides only what the surfaces leave open, such as
/// the height of an upright prism turned upside down.
struct Contact {
  Eigen::Vector3d point_in_pose2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_in_pose1 = Eigen::Vector3d::Zero();  ///< unit
  double offset_mm = 0.0;                                     ///< normal.x = offset
  bool is_flat = false;                                       ///< of flat, measured surface: it outweighs edges
};

/// A turn of pose 2 that changes no surface, of a body of revolution: noise would let it drift. Pose 1's frame.
struct FreeTurn {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();  ///< unit
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis
};

struct RefineOptions {
  double capture_mm = 12.0;  ///< farthest distance between corresponding surfaces at the start
  double capture = 1.0;      ///< the same as a share of the object's size; the lesser of both holds
  double keep = 0.8;         ///< share of the correspondences that is used, the closest ones
  int levels = 3;
  int max_iterations = 25;  ///< maximum Gauss-Newton steps per level
  std::vector<Contact> contacts;
  std::vector<FreeTurn> held{};          ///< turns that stay as they start
  double min_facing = 0.25;              ///< cosine below which a view does not judge a point
  double min_agreement = 0.6;            ///< cosine between corresponding normals
  std::size_t min_correspondences = 30;  ///< fewer are no overlap
  double min_overlap = 0.02;             ///< share of both surfaces
  double robust_scales = 3.0;            ///< scale of the robust weight, in standard deviations of the residuals
  double contact_share = 3e-5;           ///< weight of the contacts against the surfaces': negligible beside them
  double flat_contact_share = 0.05;      ///< the same of flat ones, less the share of the surfaces that face so
  double capture_medians = 8.0;          ///< the capture distance shrinks to this many median residuals ...
  double min_capture = 0.005;            ///< ... but not below this share of the object's size
  AxisUncertainty axis = {};             ///< of the turntable; nothing for poses that were placed by hand
  CalibrationModes calibration = {};     ///< of the cameras; nothing for range images of other origin
  bool wants_covariance = true;          ///< how well the motion is known, which a search need not know
  double settled_mm = 1e-4;              ///< motion of the surface that ends the iteration on the finest level
  double coarse_settled_mm = 5e-3;       ///< the same on the other levels
};

/// Motion from pose 2 to pose 1, and its quality.
struct RefinedPose {
  Transform pose1_from_pose2 = Transform::Identity();
  double median_mm = 0.0;  ///< of |point to plane| over all correspondences, untrimmed
  double rms_mm = 0.0;
  double overlap = 0.0;  ///< share of both poses' measured area that the other pose measured too
  int correspondences = 0;
  int iterations = 0;
  /// Information matrix of (rotation vector in radians about `centre`, translation in mm), 1/variance; from sigma and
  /// the residuals, as if those of all points were independent.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  /// Of the same, in pose 1's axes: how well the motion is really known, see pose_uncertainty.h. Of level 0 only.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the shared surface, pose 1's frame
  /// Ratio of largest to smallest eigenvalue of the information, rotations measured by their arc at the object's size;
  /// above about 1e4 the data do not hold some motion (a turn of a body of revolution, a slide along a prism).
  double condition = 0.0;
};

/// The measured surface of one pose, ready for comparison with another: level 0 is the finest.
struct MeasuredPose {
  std::vector<RangeLevel> images;
  std::vector<std::vector<SurfacePoint>> samples;  ///< per level; pose frame, evenly spread
  double size_mm = 0.0;                            ///< diagonal of the box around the measured points
};

MeasuredPose measured_pose(std::span<const View> views, int levels = 3);

/// Gauss-Newton on one level from `initial`: point to plane, both directions, robust, trimmed. `iterations` of the
/// result is 0 when the two surfaces do not overlap. The capture distance shrinks with the residuals.
RefinedPose align(const MeasuredPose& pose1, const MeasuredPose& pose2, const Transform& initial, int level,
                  double capture_mm, const RefineOptions& options);

/// The rigid motion that aligns pose 2's range images with pose 1's, from a start within about 8 deg and 5 mm [Park and
/// Subbarao 2002, refinement]: point to plane both ways, weighted by sigma, coarse to fine.
/// Same bits for any number of threads. Fails with `degenerate` (a pose has no measured surface), `no_overlap` (the
/// surfaces share less than 2 % from this start), `stopped`.
Result<RefinedPose> refine_pose(std::span<const View> pose1, std::span<const View> pose2,
                                const Transform& pose1_from_pose2, const RefineOptions& options,
                                const Context& context);

/// The same of poses that are measured already, on `options.levels` levels or more.
Result<RefinedPose> refine_pose(const MeasuredPose& pose1, const MeasuredPose& pose2, const Transform& pose1_from_pose2,
                                const RefineOptions& options, const Context& context);

}  // namespace scanrig
