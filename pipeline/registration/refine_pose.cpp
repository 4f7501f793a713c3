#include "pipeline/registration/refine_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/statistics.h"
#include "pipeline/registration/pose_equations.h"
#include "pipeline/registration/pose_uncertainty.h"

namespace scanrig {
namespace {

double condition_of(const Matrix6& information, double arm_mm) {
  Vector6 arc;
  arc << Eigen::Vector3d::Constant(1.0 / arm_mm), Eigen::Vector3d::Ones();
  const Matrix6 scaled = arc.asDiagonal() * information * arc.asDiagonal();
  const Vector6 values = Eigen::SelfAdjointEigenSolver<Matrix6>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  return values[5] / std::max(values[0], 1e-12 * values[5]);
}

}  // namespace

MeasuredPose measured_pose(std::span<const View> views, int levels) {
  MeasuredPose pose;
  pose.images = range_pyramid(views, levels);
  pose.size_mm = measured_size(pose.images.back());
  for (int level = 0; level < levels; ++level) {
    const double spacing = pose.size_mm / (150 >> level);  // some 20000 points at level 0, a quarter at each next one
    pose.samples.push_back(pose.size_mm > 0 ? sample_surface(pose.images[level], spacing)
                                            : std::vector<SurfacePoint>{});
  }
  return pose;
}

RefinedPose align(const MeasuredPose& pose1, const MeasuredPose& pose2, const Transform& initial, int level,
                  double capture_mm, const RefineOptions& options) {
  RefinedPose result;
  result.pose1_from_pose2 = initial;
  const double arm = 0.25 * (pose1.size_mm + pose2.size_mm);
  const double narrowest = 2.0 * options.min_capture * arm;
  double capture = capture_mm;
  PoseCorrespondences found = find_both_ways(pose1, pose2, initial, level, capture, options);
  while (result.iterations < options.max_iterations && found.all.size() >= options.min_correspondences) {
    MotionEquations e = motion_equations(found, options);
    add_contacts(options, result.pose1_from_pose2, e);
    hold_turns(options, e);
    const Matrix6 damped = e.normal + 1e-9 * e.normal.trace() * Matrix6::Identity();
    const Vector6 x = damped.ldlt().solve(e.right);
    const Eigen::Translation3d to_centre(e.centre);
    result.pose1_from_pose2 =
        to_centre * small_motion(x.head<3>(), x.tail<3>()) * to_centre.inverse() * result.pose1_from_pose2;
    ++result.iterations;
    capture = std::clamp(options.capture_medians * quantile(distances_found(found), 0.5), std::min(narrowest, capture),
                         capture);
    found = find_both_ways(pose1, pose2, result.pose1_from_pose2, level, capture, options);
    if (x.head<3>().norm() * arm + x.tail<3>().norm() < (level == 0 ? options.settled_mm : options.coarse_settled_mm))
      break;
  }
  if (found.all.size() < options.min_correspondences) return {.pose1_from_pose2 = initial};
  const bool wants_covariance = level == 0 && options.wants_covariance;
  std::vector<MotionScore> scores;
  const MotionEquations e = motion_equations(found, options, wants_covariance ? &scores : nullptr);
  const std::vector<double> distances = distances_found(found);
  result.median_mm = quantile(distances, 0.5);
  result.rms_mm = root_mean_square(distances);
  result.overlap = static_cast<double>(found.samples_seen) /
                   static_cast<double>(pose1.samples[level].size() + pose2.samples[level].size());
  result.correspondences = static_cast<int>(found.all.size());
  result.information = e.normal;
  if (wants_covariance) {
    const auto pull = pull_of_calibration(scores, views_of(pose1, pose2), result.pose1_from_pose2, options.calibration);
    result.covariance = motion_covariance(e.normal, scores) + covariance_of_pull(e.normal, pull) +
                        axis_covariance(result.pose1_from_pose2, e.centre, options.axis);
  }
  result.centre = e.centre;
  result.condition = condition_of(e.normal, arm);
  return result;
}

Result<RefinedPose> refine_pose(std::span<const View> views1, std::span<const View> views2,
                                const Transform& pose1_from_pose2, const RefineOptions& options,
                                const Context& context) {
  return refine_pose(measured_pose(views1, options.levels), measured_pose(views2, options.levels), pose1_from_pose2,
                     options, context);
}

Result<RefinedPose> refine_pose(const MeasuredPose& pose1, const MeasuredPose& pose2, const Transform& pose1_from_pose2,
                                const RefineOptions& options, const Context& context) {
  const auto coarsest = static_cast<std::size_t>(options.levels - 1);
  for (const MeasuredPose* pose : {&pose1, &pose2}) {
    if (pose->samples[coarsest].size() < options.min_correspondences) {
      return fail(ErrorCode::degenerate, "pose refinement: pose {} has no measured surface", pose == &pose1 ? 1 : 2);
    }
  }
  RefinedPose refined;
  Transform start = pose1_from_pose2;
  double capture = std::min(options.capture_mm, options.capture * pose1.size_mm);
  for (int level = options.levels - 1; level >= 0; --level) {
    if (context.stopped()) return fail(ErrorCode::stopped, "pose refinement: stopped");
    refined = align(pose1, pose2, start, level, capture, options);
    if (refined.iterations == 0 || refined.overlap < options.min_overlap) {
      return fail(ErrorCode::no_overlap,
                  "pose refinement: the two poses share {:.1f} % of their surface from this start; "
                  "at least {:.0f} % are needed",
                  100.0 * refined.overlap, 100.0 * options.min_overlap);
    }
    start = refined.pose1_from_pose2;
    capture =
        std::min(capture, std::max(options.capture_medians * refined.median_mm, options.min_capture * pose1.size_mm));
    context.report("refine", 1.0 - static_cast<double>(level) / options.levels);
  }
  return refined;
}

}  // namespace scanrig
