#pragma once

#include <span>
#include <vector>

#include "pipeline/registration/refine_pose.h"

/// What two poses' range images say of the motion between them, as least squares. Internal to this folder.
namespace scanrig {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// A point of pose 2's surface that must lie on a plane of pose 1, or the other way round; pose 1's frame.
struct PoseCorrespondence {
  Eigen::Vector3d moving;  ///< the point that moves with pose 2
  Eigen::Vector3d normal;
  double distance;  ///< positive: moving pose 2 along the normal makes it larger
  double sigma;
  int view1, view2;  ///< of pose 1 and pose 2
};

struct PoseCorrespondences {
  std::vector<PoseCorrespondence> all;
  std::size_t samples_seen = 0;
};

/// Where they stand.
PairOfViews views_of(const MeasuredPose& pose1, const MeasuredPose& pose2);

/// Samples of either pose on the other's range images.
PoseCorrespondences find_both_ways(const MeasuredPose& pose1, const MeasuredPose& pose2,
                                   const Transform& pose1_from_pose2, int level, double capture_mm,
                                   const RefineOptions& options);

/// Without their signs.
std::vector<double> distances_found(const PoseCorrespondences& found);

/// Normal equations of (rotation vector about `centre`, translation), pose 1's frame.
struct MotionEquations {
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// `scores`: of the correspondences used, if wanted.
MotionEquations motion_equations(const PoseCorrespondences& found, const RefineOptions& options,
                                 std::vector<MotionScore>* scores = nullptr);

void add_contacts(const RefineOptions& options, const Transform& pose1_from_pose2, MotionEquations& e);

/// Holds the turns that the surfaces leave open; along them alone the solution differs.
void hold_turns(const RefineOptions& options, MotionEquations& e);

}  // namespace scanrig
