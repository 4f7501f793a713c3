#include "pipeline/pose/agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

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

/// A point of another pose, carried into the frame of `observations`.
struct CarriedSample {
  const PoseObservations& observations;
  int level;
  const SurfacePoint& sample;
  double reach_mm;
  const AgreementOptions& options;

  [[nodiscard]] const RangeLevel& images() const { return observations.measured->images[level]; }
  /// Whether view `v` saw that nothing is there.
  [[nodiscard]] bool is_empty_in(std::size_t v) const {
    const View& view = observations.views[v];
    const RangeImage& image = images()[v];
    const Eigen::Vector3d p = image.camera_from_pose * sample.point;
    if (!is_behind(image, p) &&
        looked_through(image, view.range.background, 1 << level, p, reach_mm, options.clear_px)) {
      return true;
    }
    return std::ranges::any_of(view.silhouettes, [&](const Silhouette& s) {
      return outside_silhouette(s, sample.point, options.silhouette_px);
    });
  }
  /// Whether enough views did.
  [[nodiscard]] bool is_in_free_space() const {
    const std::size_t count = images().size();
    const std::size_t enough = std::min(options.witnesses, (count + 2) / 3);
    std::size_t witnesses = 0;
    for (std::size_t v = 0; v < count && witnesses + count - v >= enough; ++v) {
      if (is_empty_in(v) && ++witnesses >= enough) return true;
    }
    return false;
  }
  [[nodiscard]] double facing(std::size_t v) const {
    return -images()[v].camera_from_pose.linear().row(2).dot(sample.normal);
  }
  /// What view `v` measured next to it.
  [[nodiscard]] std::optional<SampleCheck> surface_in(std::size_t v) const {
    const RangeImage& image = images()[v];
    const Eigen::Vector3d p = image.camera_from_pose * sample.point;
    if (is_behind(image, p)) return std::nullopt;
    const auto plane = tangent_plane_near(image, p);
    if (!plane || plane->normal.dot(image.camera_from_pose.linear() * sample.normal) < options.min_agreement)
      return std::nullopt;
    const double distance = plane->normal.dot(p - plane->point);
    if (std::abs(distance) > reach_mm) return std::nullopt;
    return SampleCheck{SampleCheck::Kind::surface, static_cast<float>(distance),
                       static_cast<float>(std::hypot(plane->sigma, sample.sigma))};
  }

 private:
  static bool is_behind(const RangeImage& image, const Eigen::Vector3d& p) {
    return image.projection.kind == Projection::Kind::pinhole && p.z() <= 0.0;
  }
};

}  // namespace

SampleCheck check_sample(const PoseObservations& observations, int level, const SurfacePoint& sample, double reach_mm,
                         const AgreementOptions& options) {
  if (options.has_table && sample.point.y() < -2.0 * reach_mm) return kFreeSpace;  // inside the table
  const CarriedSample carried{observations, level, sample, reach_mm, options};
  if (carried.is_in_free_space()) return kFreeSpace;
  // The view that faces it best says where the surface is; the next one if that did not measure there.
  double below = std::numeric_limits<double>::infinity();
  while (true) {
    std::optional<std::size_t> next;
    for (std::size_t v = 0; v < carried.images().size(); ++v) {
      const double facing = carried.facing(v);
      if (facing < below && facing >= (next ? carried.facing(*next) : options.min_facing)) next = v;
    }
    if (!next) return {};
    below = carried.facing(*next);
    if (carried.is_empty_in(*next)) continue;
    if (const auto surface = carried.surface_in(*next)) return *surface;
  }
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
  const int image_level = std::max(level - 1, 0);
  std::vector<SampleCheck> sample_checks(samples2.size() + samples1.size());
  const Transform pose2_from_pose1 = pose1_from_pose2.inverse();
  parallel_for((sample_checks.size() + kBlock - 1) / kBlock, [&](std::size_t b) {
    for (std::size_t i = b * kBlock; i < std::min(sample_checks.size(), (b + 1) * kBlock); ++i) {
      const bool of_pose2 = i < samples2.size();
      const Transform& motion = of_pose2 ? pose1_from_pose2 : pose2_from_pose1;
      SurfacePoint sample = of_pose2 ? samples2[i] : samples1[i - samples2.size()];
      sample.point = motion * sample.point;
      sample.normal = motion.linear() * sample.normal;
      sample_checks[i] = check_sample(of_pose2 ? pose1 : pose2, image_level, sample, reach_mm, options);
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
