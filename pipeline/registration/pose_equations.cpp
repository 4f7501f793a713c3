#include "pipeline/registration/pose_equations.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/registration/robust.h"

namespace scanrig {
namespace {

constexpr std::size_t kSamplesPerTask = 256;

/// Compares `samples` (frame A) with the images of the other pose (frame B). `pose1_from_a` and `pose1_from_b` express
/// the result in pose 1's frame; `moving`: A is the pose that moves.
PoseCorrespondences find_one_way(const std::vector<SurfacePoint>& samples, const RangeLevel& images,
                                 const Transform& pose1_from_a, const Transform& pose1_from_b, bool moving,
                                 double capture_mm, const RefineOptions& options) {
  std::vector<Transform> camera_from_a;
  std::vector<Transform> pose1_from_camera;
  for (const RangeImage& image : images) {
    camera_from_a.push_back(image.camera_from_pose * pose1_from_b.inverse() * pose1_from_a);
    pose1_from_camera.push_back(pose1_from_b * image.camera_from_pose.inverse());
  }
  const std::size_t blocks = (samples.size() + kSamplesPerTask - 1) / kSamplesPerTask;
  std::vector<PoseCorrespondences> parts(blocks);
  parallel_for(blocks, [&](std::size_t b) {
    for (std::size_t i = b * kSamplesPerTask; i < std::min(samples.size(), (b + 1) * kSamplesPerTask); ++i) {
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
        parts[b].all.push_back(
            {pose1_from_camera[v] * (moving ? point : plane->point), pose1_from_camera[v].linear() * plane->normal,
             moving ? distance : -distance, std::hypot(samples[i].sigma, plane->sigma),
             moving ? static_cast<int>(v) : samples[i].view, moving ? samples[i].view : static_cast<int>(v)});
      }
      if (seen) ++parts[b].samples_seen;
    }
  });
  PoseCorrespondences found;
  for (const PoseCorrespondences& part : parts) {
    found.all.insert(found.all.end(), part.all.begin(), part.all.end());
    found.samples_seen += part.samples_seen;
  }
  return found;
}

}  // namespace

PairOfViews views_of(const MeasuredPose& pose1, const MeasuredPose& pose2) {
  PairOfViews views;
  for (const RangeImage& image : pose1.images.front()) views.pose1.push_back(image.camera_from_pose);
  for (const RangeImage& image : pose2.images.front()) views.pose2.push_back(image.camera_from_pose);
  return views;
}

PoseCorrespondences find_both_ways(const MeasuredPose& pose1, const MeasuredPose& pose2,
                                   const Transform& pose1_from_pose2, int level, double capture_mm,
                                   const RefineOptions& options) {
  const Transform same = Transform::Identity();
  PoseCorrespondences found =
      find_one_way(pose2.samples[level], pose1.images[level], pose1_from_pose2, same, true, capture_mm, options);
  const PoseCorrespondences back =
      find_one_way(pose1.samples[level], pose2.images[level], same, pose1_from_pose2, false, capture_mm, options);
  found.all.insert(found.all.end(), back.all.begin(), back.all.end());
  found.samples_seen += back.samples_seen;
  return found;
}

std::vector<double> distances_found(const PoseCorrespondences& found) {
  std::vector<double> distances;
  distances.reserve(found.all.size());
  for (const PoseCorrespondence& c : found.all) distances.push_back(std::abs(c.distance));
  return distances;
}

MotionEquations motion_equations(const PoseCorrespondences& found, const RefineOptions& options,
                                 std::vector<MotionScore>* scores) {
  MotionEquations e;
  for (const PoseCorrespondence& c : found.all) e.centre += c.moving;
  e.centre /= static_cast<double>(found.all.size());
  const std::vector<double> distances = distances_found(found);
  const double scale = std::max(1.4826 * quantile(distances, 0.5), 1e-6);
  const double limit = quantile(distances, options.keep);
  for (const PoseCorrespondence& c : found.all) {
    if (std::abs(c.distance) > limit) continue;
    // The residuals' own spread is added to sigma: errors not covered by sigma must not let a few points decide.
    const double w = robust_weight(c.distance, options.robust_scales * scale) / (c.sigma * c.sigma + scale * scale);
    Vector6 j;
    j << (c.moving - e.centre).cross(c.normal), c.normal;
    e.normal.noalias() += w * j * j.transpose();
    e.right -= w * c.distance * j;
    if (scores != nullptr) scores->push_back({j, w, c.distance, c.view1, c.view2, c.moving});
  }
  return e;
}

/// What holds a height only: edges that rest on a table leave the turns to the surfaces.
void add_contacts(const RefineOptions& options, const Transform& pose1_from_pose2, MotionEquations& e) {
  const Eigen::Matrix3d surfaces = e.normal.bottomRightCorner<3, 3>();
  for (const Contact& c : options.contacts) {
    const double facing_so = c.normal_in_pose1.dot(surfaces * c.normal_in_pose1) / surfaces.trace();
    const double flat_share = c.is_flat ? options.flat_contact_share - facing_so : 0.0;
    const double w = std::max(options.contact_share, flat_share) * surfaces.trace();
    const Eigen::Vector3d point = pose1_from_pose2 * c.point_in_pose2;
    Vector6 j = Vector6::Zero();
    j.tail<3>() = c.normal_in_pose1;
    if (c.is_flat) j.head<3>() = (point - e.centre).cross(c.normal_in_pose1);
    e.normal += w * j * j.transpose();
    e.right -= w * (c.normal_in_pose1.dot(point) - c.offset_mm) * j;
  }
}

void hold_turns(const RefineOptions& options, MotionEquations& e) {
  const double w = e.normal.trace();
  for (const FreeTurn& turn : options.held) {
    Vector6 k;
    k << turn.axis, turn.axis.cross(e.centre - turn.point);
    e.normal += w / k.squaredNorm() * k * k.transpose();
  }
}

}  // namespace scanrig
