#include "pipeline/pose/agreement.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/registration/robust.h"

namespace scanrig {
namespace {

constexpr double kMinFacing = 0.25;    // cosine at which a view is no longer asked about a point
constexpr double kMinAgreement = 0.6;  // cosine between corresponding normals
constexpr double kSilhouettePx = 2.0;  // farther outside than this is outside
constexpr double kTolerance = 4.0;     // standard deviations
constexpr int kClearPx = 2;            // free space must be so for neighbours this far away too
constexpr std::size_t kBlock = 128;
constexpr SampleCheck kFreeSpace{SampleCheck::Kind::free_space, 0.0F, 0.0F};

/// True where the camera looked through `p` (camera frame) and so did its neighbours, at least `reach_mm` deep.
bool looked_through(const RangeImage& image, const cv::Mat1b& background, int background_scale,
                    const Eigen::Vector3d& p, double reach_mm) {
  const Projection& projection = image.projection;
  const Eigen::Vector2d pixel = projection.project(p);
  if (!projection.contains(pixel, kClearPx)) return false;
  const int row = static_cast<int>(std::lround(pixel.y()));
  const int column = static_cast<int>(std::lround(pixel.x()));
  for (const auto& [dr, dc] :
       {std::pair{0, 0}, {-kClearPx, -kClearPx}, {-kClearPx, kClearPx}, {kClearPx, -kClearPx}, {kClearPx, kClearPx}}) {
    const float depth = image.depth(row + dr, column + dc);
    if (std::isnan(depth)) {
      if (background.empty() || !background((row + dr) * background_scale, (column + dc) * background_scale))
        return false;
    } else if (depth < p.z() + reach_mm) {
      return false;
    }
  }
  return true;
}

bool outside_silhouette(const Silhouette& silhouette, const Eigen::Vector3d& p) {
  const Eigen::Vector3d q = silhouette.camera_from_pose * p;
  if (q.z() <= 0.0) return false;
  const Eigen::Vector2d pixel = silhouette.projection.project(q);
  if (!silhouette.projection.contains(pixel)) return false;
  return silhouette.outside_px(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x()))) >
         kSilhouettePx;
}

/// What `witness` says of a point and its normal, both in its own pose's frame.
SampleCheck check_sample(const PoseObservations& observations, int level, const SurfacePoint& sample, double reach_mm) {
  SampleCheck best;
  double best_facing = kMinFacing;
  if (sample.point.y() < -2.0 * reach_mm) return kFreeSpace;  // inside the table
  const RangeLevel& images = observations.measured->images[level];
  for (std::size_t v = 0; v < images.size(); ++v) {
    for (const Silhouette& s : observations.views[v].silhouettes) {
      if (outside_silhouette(s, sample.point)) return kFreeSpace;
    }
    const Eigen::Vector3d p = images[v].camera_from_pose * sample.point;
    if (images[v].projection.kind == Projection::Kind::pinhole && p.z() <= 0.0) continue;
    if (looked_through(images[v], observations.views[v].range.background, 1 << level, p, reach_mm)) {
      return kFreeSpace;
    }
    const Eigen::Vector3d normal = images[v].camera_from_pose.linear() * sample.normal;
    if (-normal.z() < best_facing) continue;
    const auto plane = tangent_plane_near(images[v], p);
    if (!plane || plane->normal.dot(normal) < kMinAgreement) continue;
    const double distance = plane->normal.dot(p - plane->point);
    if (std::abs(distance) > reach_mm) continue;
    best_facing = -normal.z();
    best = {SampleCheck::Kind::surface, static_cast<float>(distance),
            static_cast<float>(std::hypot(plane->sigma, sample.sigma))};
  }
  return best;
}

bool contradicts(const SampleCheck& t, double spread_mm, double tolerance = kTolerance) {
  if (t.kind == SampleCheck::Kind::free_space) return true;
  return t.kind == SampleCheck::Kind::surface &&
         std::abs(t.distance_mm) > tolerance * std::hypot(static_cast<double>(t.sigma_mm), spread_mm);
}

}  // namespace

std::vector<SampleCheck> check_samples(const PoseObservations& pose1, const PoseObservations& pose2,
                                       const Transform& pose1_from_pose2, int level, double reach_mm) {
  const auto& samples2 = pose2.measured->samples[level];
  const auto& samples1 = pose1.measured->samples[level];
  std::vector<SampleCheck> sample_checks(samples2.size() + samples1.size());
  const Transform pose2_from_pose1 = pose1_from_pose2.inverse();
  parallel_for((sample_checks.size() + kBlock - 1) / kBlock, [&](std::size_t b) {
    for (std::size_t i = b * kBlock; i < std::min(sample_checks.size(), (b + 1) * kBlock); ++i) {
      const bool of_pose2 = i < samples2.size();
      const Transform& motion = of_pose2 ? pose1_from_pose2 : pose2_from_pose1;
      SurfacePoint sample = of_pose2 ? samples2[i] : samples1[i - samples2.size()];
      sample.point = motion * sample.point;
      sample.normal = motion.linear() * sample.normal;
      sample_checks[i] = check_sample(of_pose2 ? pose1 : pose2, level, sample, reach_mm);
    }
  });
  return sample_checks;
}

Agreement count_agreement(const std::vector<SampleCheck>& sample_checks, double spread_mm) {
  Agreement result;
  std::vector<double> distances;
  for (const SampleCheck& t : sample_checks) {
    if (t.kind == SampleCheck::Kind::surface) distances.push_back(std::abs(t.distance_mm));
    if (t.kind == SampleCheck::Kind::free_space) ++result.free_space;
    if (contradicts(t, spread_mm)) {
      ++result.contradicted;
    } else if (t.kind == SampleCheck::Kind::surface) {
      ++result.confirmed;
    }
  }
  const double all = static_cast<double>(std::max<std::size_t>(sample_checks.size(), 1));
  result.confirmed /= all;
  result.contradicted /= all;
  result.free_space /= all;
  result.median_mm = quantile(std::move(distances), 0.5);
  return result;
}

AgreementGap compare(const std::vector<SampleCheck>& first, const std::vector<SampleCheck>& second, double spread_mm) {
  AgreementGap result;
  for (const double tolerance : {3.0 * kTolerance, kTolerance}) {
    int only_first = 0;
    int only_second = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      const bool a = contradicts(first[i], spread_mm, tolerance);
      const bool b = contradicts(second[i], spread_mm, tolerance);
      only_first += a && !b;
      only_second += b && !a;
    }
    result.contradicted_more = only_second - only_first;
    result.separable |= result.contradicted_more > 4.0 * std::sqrt(static_cast<double>(only_first + only_second)) + 4.0;
  }
  return result;
}

}  // namespace scanrig
