#include "pipeline/pose/agreement.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/registration/robust.h"

namespace scanrig {
namespace {

constexpr std::size_t kBlock = 128;
constexpr SampleCheck kFreeSpace{SampleCheck::Kind::free_space, 0.0F, 0.0F};

/// True where the camera looked through `p` (camera frame) and so did its neighbours, at least `reach_mm` deep.
bool looked_through(const RangeImage& image, const cv::Mat1b& background, int background_scale,
                    const Eigen::Vector3d& p, double reach_mm, int clear_px) {
  const Projection& projection = image.projection;
  const Eigen::Vector2d pixel = projection.project(p);
  if (!projection.contains(pixel, clear_px)) return projection.is_cropped_off(pixel, clear_px);
  const int row = static_cast<int>(std::lround(pixel.y()));
  const int column = static_cast<int>(std::lround(pixel.x()));
  for (const auto& [dr, dc] :
       {std::pair{0, 0}, {-clear_px, -clear_px}, {-clear_px, clear_px}, {clear_px, -clear_px}, {clear_px, clear_px}}) {
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

bool outside_silhouette(const Silhouette& silhouette, const Eigen::Vector3d& p, double min_outside_px) {
  const Eigen::Vector3d q = silhouette.camera_from_pose * p;
  if (q.z() <= 0.0) return false;
  const Eigen::Vector2d pixel = silhouette.projection.project(q);
  if (!silhouette.projection.contains(pixel)) return silhouette.projection.is_cropped_off(pixel);
  return silhouette.outside_px(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x()))) >
         min_outside_px;
}

}  // namespace

SampleCheck check_sample(const PoseObservations& observations, int level, const SurfacePoint& sample, double reach_mm,
                         const AgreementOptions& options) {
  SampleCheck best;
  double best_facing = options.min_facing;
  if (options.has_table && sample.point.y() < -2.0 * reach_mm) return kFreeSpace;  // inside the table
  const RangeLevel& images = observations.measured->images[level];
  const std::size_t enough = std::min(options.witnesses, (images.size() + 2) / 3);
  std::size_t witnesses = 0;
  for (std::size_t v = 0; v < images.size(); ++v) {
    const View& view = observations.views[v];
    const Eigen::Vector3d p = images[v].camera_from_pose * sample.point;
    const bool behind = images[v].projection.kind == Projection::Kind::pinhole && p.z() <= 0.0;
    const bool is_outside = std::any_of(view.silhouettes.begin(), view.silhouettes.end(), [&](const Silhouette& s) {
      return outside_silhouette(s, sample.point, options.silhouette_px);
    });
    if (is_outside ||
        (!behind && looked_through(images[v], view.range.background, 1 << level, p, reach_mm, options.clear_px))) {
      if (++witnesses >= enough) return kFreeSpace;
      continue;
    }
    if (behind) continue;
    const Eigen::Vector3d normal = images[v].camera_from_pose.linear() * sample.normal;
    if (-normal.z() < best_facing) continue;
    const auto plane = tangent_plane_near(images[v], p);
    if (!plane || plane->normal.dot(normal) < options.min_agreement) continue;
    const double distance = plane->normal.dot(p - plane->point);
    if (std::abs(distance) > reach_mm) continue;
    best_facing = -normal.z();
    best = {SampleCheck::Kind::surface, static_cast<float>(distance),
            static_cast<float>(std::hypot(plane->sigma, sample.sigma))};
  }
  return best;
}

bool contradicts(const SampleCheck& check, double spread_mm, double tolerance) {
  if (check.kind == SampleCheck::Kind::free_space) return true;
  return check.kind == SampleCheck::Kind::surface &&
         std::abs(check.distance_mm) > tolerance * std::hypot(static_cast<double>(check.sigma_mm), spread_mm);
}

std::vector<SampleCheck> check_samples(const PoseObservations& pose1, const PoseObservations& pose2,
                                       const Transform& pose1_from_pose2, int level, double reach_mm,
                                       const AgreementOptions& options) {
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
      sample_checks[i] = check_sample(of_pose2 ? pose1 : pose2, level, sample, reach_mm, options);
    }
  });
  return sample_checks;
}

Agreement count_agreement(const std::vector<SampleCheck>& sample_checks, double spread_mm,
                          const AgreementOptions& options) {
  Agreement result;
  std::vector<double> distances;
  for (const SampleCheck& t : sample_checks) {
    if (t.kind == SampleCheck::Kind::surface) distances.push_back(std::abs(t.distance_mm));
    if (t.kind == SampleCheck::Kind::free_space) ++result.free_space;
    if (contradicts(t, spread_mm, options.tolerance)) {
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

AgreementGap compare(const std::vector<SampleCheck>& first, const std::vector<SampleCheck>& second, double spread_mm,
                     const AgreementOptions& options) {
  AgreementGap result;
  for (const double tolerance : {options.wide_tolerance, options.tolerance}) {
    int only_first = 0;
    int only_second = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      const bool a = contradicts(first[i], spread_mm, tolerance);
      const bool b = contradicts(second[i], spread_mm, tolerance);
      only_first += a && !b;
      only_second += b && !a;
    }
    result.contradicted_more = only_second - only_first;
    result.separable |=
        result.contradicted_more >
        options.separable * std::sqrt(static_cast<double>(only_first + only_second)) + options.separable;
  }
  return result;
}

}  // namespace scanrig
