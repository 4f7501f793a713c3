#include "pipeline/registration/refine_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/registration/pose_uncertainty.h"
#include "pipeline/registration/robust.h"

namespace scanrig {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::size_t kBlock = 256;  // samples per task

/// A point of pose 2's surface that must lie on a plane of pose 1, or the other way round; pose 1's frame.
struct Correspondence {
  Eigen::Vector3d moving;  ///< the point that moves with pose 2
  Eigen::Vector3d normal;
  double distance;  ///< positive: moving pose 2 along the normal makes it larger
  double sigma;
  int view1, view2;  ///< of pose 1 and pose 2
};

struct Found {
  std::vector<Correspondence> correspondences;
  std::size_t samples_seen = 0;
};

/// Compares `samples` (frame A) with the images of the other pose (frame B). `pose1_from_a` and `pose1_from_b` express
/// the result in pose 1's frame; `moving`: A is the pose that moves.
Found find(const std::vector<SurfacePoint>& samples, const RangeLevel& images, const Transform& pose1_from_a,
           const Transform& pose1_from_b, bool moving, double capture_mm, const RefineOptions& options) {
  std::vector<Transform> camera_from_a;
  std::vector<Transform> pose1_from_camera;
  for (const RangeImage& image : images) {
    camera_from_a.push_back(image.camera_from_pose * pose1_from_b.inverse() * pose1_from_a);
    pose1_from_camera.push_back(pose1_from_b * image.camera_from_pose.inverse());
  }
  const std::size_t blocks = (samples.size() + kBlock - 1) / kBlock;
  std::vector<Found> parts(blocks);
  parallel_for(blocks, [&](std::size_t b) {
    for (std::size_t i = b * kBlock; i < std::min(samples.size(), (b + 1) * kBlock); ++i) {
      bool seen = false;
      for (std::size_t v = 0; v < images.size(); ++v) {
        const Eigen::Vector3d normal = camera_from_a[v].linear() * samples[i].normal;
        if (normal.z() > -options.min_facing) continue;
        const Eigen::Vector3d point = camera_from_a[v] * samples[i].point;
        const auto plane = tangent_plane_near(images[v], point);
        if (!plane || plane->normal.dot(normal) < options.min_agreement) continue;
        const double distance = plane->normal.dot(point - plane->point);
        if (std::abs(distance) > capture_mm) continue;
        seen = true;
        parts[b].correspondences.push_back(
            {pose1_from_camera[v] * (moving ? point : plane->point), pose1_from_camera[v].linear() * plane->normal,
             moving ? distance : -distance, std::hypot(samples[i].sigma, plane->sigma),
             moving ? static_cast<int>(v) : samples[i].view, moving ? samples[i].view : static_cast<int>(v)});
      }
      if (seen) ++parts[b].samples_seen;
    }
  });
  Found found;
  for (const Found& part : parts) {
    found.correspondences.insert(found.correspondences.end(), part.correspondences.begin(), part.correspondences.end());
    found.samples_seen += part.samples_seen;
  }
  return found;
}

Found find_both_ways(const MeasuredPose& pose1, const MeasuredPose& pose2, const Transform& pose1_from_pose2, int level,
                     double capture_mm, const RefineOptions& options) {
  const Transform same = Transform::Identity();
  Found found = find(pose2.samples[level], pose1.images[level], pose1_from_pose2, same, true, capture_mm, options);
  const Found back =
      find(pose1.samples[level], pose2.images[level], same, pose1_from_pose2, false, capture_mm, options);
  found.correspondences.insert(found.correspondences.end(), back.correspondences.begin(), back.correspondences.end());
  found.samples_seen += back.samples_seen;
  return found;
}

std::vector<double> distances_of(const Found& found) {
  std::vector<double> distances;
  distances.reserve(found.correspondences.size());
  for (const Correspondence& c : found.correspondences) distances.push_back(std::abs(c.distance));
  return distances;
}

struct Equations {
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// `scores`: of the correspondences used, if wanted.
Equations accumulate(const Found& found, const RefineOptions& options, std::vector<MotionScore>* scores = nullptr) {
  Equations e;
  for (const Correspondence& c : found.correspondences) e.centre += c.moving;
  e.centre /= static_cast<double>(found.correspondences.size());
  const std::vector<double> distances = distances_of(found);
  const double scale = std::max(1.4826 * quantile(distances, 0.5), 1e-6);
  const double limit = quantile(distances, options.keep);
  for (const Correspondence& c : found.correspondences) {
    if (std::abs(c.distance) > limit) continue;
    // The residuals' own spread is added to sigma: errors not covered by sigma must not let a few points decide.
    const double w = robust_weight(c.distance, options.robust_scales * scale) / (c.sigma * c.sigma + scale * scale);
    Vector6 j;
    j << (c.moving - e.centre).cross(c.normal), c.normal;
    e.normal.noalias() += w * j * j.transpose();
    const Vector6 pull = w * c.distance * j;
    e.right -= pull;
    if (scores != nullptr) scores->push_back({pull, c.view1, c.view2});
  }
  return e;
}

void add_contacts(const RefineOptions& options, const Transform& pose1_from_pose2, Equations& e) {
  const double w = options.contact_share * e.normal.bottomRightCorner<3, 3>().trace();
  for (const Contact& c : options.contacts) {
    const double distance = c.normal_in_pose1.dot(pose1_from_pose2 * c.point_in_pose2) - c.offset_mm;
    e.normal.bottomRightCorner<3, 3>() += w * c.normal_in_pose1 * c.normal_in_pose1.transpose();
    e.right.tail<3>() -= w * distance * c.normal_in_pose1;
  }
}

/// Holds the turns that the surfaces leave open; along them alone the solution differs.
void hold_turns(const RefineOptions& options, Equations& e) {
  const double w = e.normal.trace();
  for (const FreeTurn& turn : options.held) {
    Vector6 k;
    k << turn.axis, turn.axis.cross(e.centre - turn.point);
    e.normal += w / k.squaredNorm() * k * k.transpose();
  }
}

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
  Found found = find_both_ways(pose1, pose2, initial, level, capture, options);
  while (result.iterations < options.max_iterations && found.correspondences.size() >= options.min_correspondences) {
    Equations e = accumulate(found, options);
    add_contacts(options, result.pose1_from_pose2, e);
    hold_turns(options, e);
    const Matrix6 damped = e.normal + 1e-9 * e.normal.trace() * Matrix6::Identity();
    const Vector6 x = damped.ldlt().solve(e.right);
    const Eigen::Translation3d to_centre(e.centre);
    result.pose1_from_pose2 =
        to_centre * small_motion(x.head<3>(), x.tail<3>()) * to_centre.inverse() * result.pose1_from_pose2;
    ++result.iterations;
    capture =
        std::clamp(options.capture_medians * quantile(distances_of(found), 0.5), std::min(narrowest, capture), capture);
    found = find_both_ways(pose1, pose2, result.pose1_from_pose2, level, capture, options);
    if (x.head<3>().norm() * arm + x.tail<3>().norm() < (level == 0 ? options.settled_mm : options.coarse_settled_mm))
      break;
  }
  if (found.correspondences.size() < options.min_correspondences) return {.pose1_from_pose2 = initial};
  std::vector<MotionScore> scores;
  const Equations e = accumulate(found, options, level == 0 ? &scores : nullptr);
  const std::vector<double> distances = distances_of(found);
  result.median_mm = quantile(distances, 0.5);
  result.rms_mm = root_mean_square(distances);
  result.overlap = static_cast<double>(found.samples_seen) /
                   static_cast<double>(pose1.samples[level].size() + pose2.samples[level].size());
  result.correspondences = static_cast<int>(found.correspondences.size());
  result.information = e.normal;
  if (level == 0) {
    result.covariance =
        motion_covariance(e.normal, scores) + axis_covariance(result.pose1_from_pose2, e.centre, options.axis);
  }
  result.centre = e.centre;
  result.condition = condition_of(e.normal, arm);
  return result;
}

Result<RefinedPose> refine_pose(std::span<const View> views1, std::span<const View> views2,
                                const Transform& pose1_from_pose2, const RefineOptions& options,
                                const Context& context) {
  const MeasuredPose pose1 = measured_pose(views1, options.levels);
  const MeasuredPose pose2 = measured_pose(views2, options.levels);
  for (const MeasuredPose* pose : {&pose1, &pose2}) {
    if (pose->samples.back().size() < options.min_correspondences) {
      return fail(ErrorCode::degenerate, "pose refinement: pose {} has no measured surface", pose == &pose1 ? 1 : 2);
    }
  }
  RefinedPose refined;
  Transform start = pose1_from_pose2;
  double capture = options.capture_mm;
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
