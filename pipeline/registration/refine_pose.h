#pragma once

#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/registration/range_surface.h"

namespace scanrig {

/// A plane of pose 1 that a point of pose 2 is known to touch: a table top. It decides only what the surfaces leave
/// open, such as the height of an upright prism turned upside down.
struct Contact {
  Eigen::Vector3d point_in_pose2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_in_pose1 = Eigen::Vector3d::Zero();  ///< unit
  double offset_mm = 0.0;                                     ///< normal.x = offset
};

struct RefineOptions {
  double capture_mm = 12.0;  ///< farthest distance between corresponding surfaces at the start
  double keep = 0.8;         ///< share of the correspondences that is used, the closest ones
  int levels = 3;
  int iterations = 25;  ///< most Gauss-Newton steps a level
  std::vector<Contact> contacts;
};

/// How pose 2 lies on pose 1.
struct RefinedPose {
  Transform pose1_from_pose2 = Transform::Identity();
  double median_mm = 0.0;  ///< of |point to plane| over all correspondences, untrimmed
  double rms_mm = 0.0;
  double overlap = 0.0;  ///< share of both poses' measured area that the other pose measured too
  int correspondences = 0;
  int iterations = 0;
  /// Of (rotation vector in radians about `centre`, translation in mm), 1/variance; from sigma and the residuals.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the shared surface, pose 1's frame
  /// Largest by smallest eigenvalue of the information, rotations measured by the arc they make at the object's size;
  /// above about 1e4 some motion (a turn of a body of revolution, a slide along a prism) is not held by the data.
  double condition = 0.0;
};

/// The measured surface of one pose, ready to be compared with another: level 0 is the finest.
struct MeasuredPose {
  std::vector<RangeLevel> images;
  std::vector<std::vector<SurfacePoint>> samples;  ///< a level; pose frame, evenly spread
  double size_mm = 0.0;                            ///< diagonal of the box around the measured points
};

MeasuredPose measured_pose(std::span<const View> views, int levels = 3);

/// Gauss-Newton on one level from `initial`: point to plane, both directions, robust, trimmed. `iterations` of the
/// result is 0 when the two surfaces share nothing. The capture distance shrinks with the residuals.
RefinedPose align(const MeasuredPose& pose1, const MeasuredPose& pose2, const Transform& initial, int level,
                  double capture_mm, const RefineOptions& options);

/// The rigid motion that lays pose 2's range images on pose 1's, from a start within about 8 deg and 5 mm [Park and
/// Subbarao 2002, refinement]: point to plane both ways, weighted by sigma, coarse to fine.
/// Same bits for any number of threads. Fails with `degenerate` (a pose has no measured surface), `no_overlap` (the
/// surfaces share less than 2 % from this start), `stopped`.
Result<RefinedPose> refine_pose(std::span<const View> pose1, std::span<const View> pose2,
                                const Transform& pose1_from_pose2, const RefineOptions& options,
                                const Context& context);

}  // namespace scanrig
