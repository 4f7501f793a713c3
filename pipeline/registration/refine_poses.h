#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pipeline/registration/refine_pose.h"

/// All poses of a scan onto each other at once.
namespace scanrig {

/// Two poses that share surface, `pose1` the smaller number; contacts and held turns as of that pair alone.
struct PoseLink {
  std::size_t pose1 = 0, pose2 = 1;
  std::vector<Contact> contacts{};
  std::vector<FreeTurn> held{};
};

/// How well the poses of one link fit after the refinement.
struct LinkFit {
  double median_mm = 0.0;  ///< of |point to plane| over all correspondences, untrimmed
  double rms_mm = 0.0;
  double overlap = 0.0;  ///< share of both poses' measured area that the other pose measured too
  int correspondences = 0;
};

struct RefinedPoses {
  std::vector<Transform> model_from_pose;  ///< the first as it was given
  /// Of each pose (rotation vector in radians about `centre`, translation in mm), model frame, what is not known of the
  /// others included; 0 for the first. See pose_uncertainty.h.
  std::vector<Eigen::Matrix<double, 6, 6>> covariance;
  std::vector<LinkFit> links;                        ///< in the order given
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the shared surface, model frame
  double median_mm = 0.0;                            ///< over all links
  double rms_mm = 0.0;
  int iterations = 0;
};

/// As refine_pose(), for all poses but the first in one adjustment: each is one rigid block, and each link of two poses
/// has the weight, trimming and contacts that it has alone. `options.contacts` and `options.held` are not used.
/// `model_from_pose`: a start within about 8 deg and 5 mm; the axis of the turntable has one error in all poses.
/// Same bits for any number of threads. Fails with `invalid_input` (sizes; links that do not join all poses),
/// `degenerate` (a pose has no measured surface), `no_overlap` (a link shares less than 2 % from this start),
/// `stopped`.
Result<RefinedPoses> refine_poses(std::span<const std::span<const View>> poses,
                                  std::span<const Transform> model_from_pose, std::span<const PoseLink> links,
                                  const RefineOptions& options, const Context& context);

}  // namespace scanrig
