#include "pipeline/volume/distance_field.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/parallel.h"

namespace scanrig {
namespace {

/// Full weight near the surface, none at the edge of the band: the two faces of a wall as thin as the band do not pull
/// at each other, and there is no jump where the band ends.
float taper(float distance, float band) { return std::clamp(1.5F * (1.0F - std::abs(distance) / band), 0.0F, 1.0F); }

struct WeightedDistance {
  float distance, sigma, weight;
};

/// A view that is most of the mean says nothing of it.
Scatter scatter_of(const std::vector<WeightedDistance>& views) {
  constexpr float kLargest = 4.0F;     // an outlier's, in standard deviations
  constexpr float kExpected = 0.798F;  // mean of a standard normal variable's absolute value
  constexpr float kMaxShare = 0.8F;
  float weight = 0.0F, sum = 0.0F, variance = 0.0F;
  for (const auto& view : views) {
    weight += view.weight;
    sum += view.weight * view.distance;
    variance += view.weight * view.weight * view.sigma * view.sigma;
  }
  Scatter scatter;
  for (const auto& view : views) {
    const float share = view.weight / weight;
    if (share > kMaxShare) continue;
    const float expected = std::sqrt(variance / (weight * weight) + (1.0F - 2.0F * share) * view.sigma * view.sigma);
    scatter.sum += std::min(kLargest, std::abs(view.distance - sum / weight) / expected) / kExpected;
    scatter.count += 1.0F;
  }
  return scatter;
}

}  // namespace

Field::Field(std::vector<std::vector<FieldView>> views_of_pose, const SurfaceStatistics& statistics,
             const std::vector<Transform>& model_from_pose, Hull hull, const Eigen::AlignedBox3f& box,
             const VolumeOptions& options, double band_mm)
    : views_of_pose_(std::move(views_of_pose)),
      hull_(std::move(hull)),
      bricks_(box, 1),
      room_mm_(kBrickRoom * static_cast<float>(options.voxel_mm)),
      fusion_(options.fusion),
      images_per_outside_(options.images_per_outside),
      view_sigmas_(options.view_sigmas),
      band_(static_cast<float>(band_mm)),
      class_threshold_(static_cast<float>(options.class_voxels * options.voxel_mm)),
      hull_tolerance_(options.hull_tolerance * band_),
      free_weight_(statistics.median_weight),
      centre_(statistics.centre) {
  for (const auto& transform : model_from_pose) pose_from_model_.push_back(transform.inverse());
  const auto beyond = Eigen::Vector3f::Constant(2.0F * room_mm_);  // as the grid covers more than the box
  bricks_ = Bricks({box.min() - beyond, box.max() + beyond}, 1);
}

/// Of a brick and the room around it.
Eigen::AlignedBox3f Field::box_of(const Bricks& bricks, std::size_t brick) const {
  const auto room = Eigen::Vector3f::Constant(room_mm_);
  const Eigen::AlignedBox3f bare = bricks.box(brick);
  return {bare.min() - room, bare.max() + room};
}

/// Of the fullest brick, all views together.
std::uintmax_t Field::bytes_in(const Bricks& bricks) const {
  std::uintmax_t fullest = 0;
  for (std::size_t brick = 0; brick < bricks.count(); ++brick) {
    const Eigen::AlignedBox3f box = box_of(bricks, brick);
    std::uintmax_t pixels = 0;
    for (const auto& views : views_of_pose_) {
      for (const auto& view : views) pixels += static_cast<std::uintmax_t>(view.sampler.area_for(box).area());
    }
    fullest = std::max(fullest, pixels * RangeSampler::kBytesPerPixel);
  }
  return fullest;
}

void Field::divide(std::uintmax_t bytes, int max_per_axis) {
  int per_axis = 2;
  while (per_axis < max_per_axis && bytes_in(Bricks(bricks_.whole(), per_axis)) > bytes) ++per_axis;
  bricks_ = Bricks(bricks_.whole(), per_axis);
  release();
}

void Field::focus(std::size_t brick) {
  if (bricks_.count() == 1 || focused_ == brick) return;
  release();
  std::vector<FieldView*> all;
  for (auto& views : views_of_pose_) {
    for (auto& view : views) all.push_back(&view);
  }
  const Eigen::AlignedBox3f box = box_of(bricks_, brick);
  parallel_for(all.size(), [&](std::size_t i) { all[i]->sampler.focus(box, all[i]->part); });
  focused_ = brick;
}

void Field::release() {
  if (bricks_.count() == 1) return;
  for (auto& views : views_of_pose_) {
    for (auto& view : views) view.sampler.release();
  }
  focused_.reset();
}

float Field::window_mm() const {
  std::vector<float> of_views;
  for (const auto& views : views_of_pose_) {
    for (const auto& view : views) of_views.push_back(view.sampler.window_mm());
  }
  if (of_views.empty()) return 0.0F;
  const auto middle = of_views.begin() + static_cast<std::ptrdiff_t>(of_views.size() / 2);
  std::nth_element(of_views.begin(), middle, of_views.end());
  return *middle;
}

Field::Neighbourhood Field::everywhere() const {
  Neighbourhood result{{}, hull_};
  for (const auto& views : views_of_pose_) {
    for (const auto& view : views) result.views.push_back(&view.sampler);
  }
  return result;
}

Field::Neighbourhood Field::near(const Eigen::Vector3f& centre, float radius) const {
  Neighbourhood result{{}, hull_.near(centre, radius, band_)};
  for (const auto& views : views_of_pose_) {
    for (const auto& [view, part] : views) {
      if (!view.has_outline() || !view.has_no_data_near(centre, radius)) result.views.push_back(&view);
    }
  }
  return result;
}

FieldValue Field::at(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const {
  return fusion_ == VolumeOptions::Fusion::evidence ? from_evidence(point, neighbourhood)
                                                    : from_class_table(point, neighbourhood);
}

/// Hull and, where an image has neither silhouette nor background, its footprint. A point is outside if it lies beside
/// the footprint of more images than see it behind their surface, or of more than a fifth of them, and of two at least.
/// A fifth: dropouts at the same place of so many images are unlikely, while most images see a gap between two parts of
/// the object only as "behind" the nearer one.
float Field::bounds(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood, std::size_t views_behind) const {
  const float hull = neighbourhood.hull.distance(point);
  std::vector<float> beside;
  for (const auto* view : neighbourhood.views) {
    if (!view->has_outline()) beside.push_back(view->beside_footprint_mm(point));
  }
  const std::size_t rank = std::max<std::size_t>(1, std::min(views_behind, beside.size() / images_per_outside_));
  if (beside.size() <= rank) return hull;
  const auto nth = beside.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(beside.begin(), nth, beside.end(), std::greater<>());
  return std::max(hull, *nth);
}

FieldValue Field::from_evidence(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const {
  float weight = 0.0F, sum = 0.0F;
  bool is_free = false, is_surface = false;
  std::size_t views_behind = 0;
  for (const auto* view : neighbourhood.views) {
    const RangeSample s = view->sample(point);
    if (s.kind == RangeSample::Kind::surface) {
      const float w = s.weight * taper(s.distance, band_);
      weight += w;
      sum += w * s.distance;
      is_surface = true;
    } else if (s.kind == RangeSample::Kind::free) {
      is_free = true;
      if (!s.clearly_free) continue;
      weight += free_weight_;
      sum += free_weight_ * band_;
    } else if (s.kind == RangeSample::Kind::behind) {
      ++views_behind;
    }
  }
  if (is_surface && weight > 0.0F) {
    const float limit = neighbourhood.hull.distance(point) - hull_tolerance_;
    return {std::clamp(std::max(sum / weight, limit), -band_, band_), Support::measured};
  }
  const float outside = std::clamp(bounds(point, neighbourhood, views_behind), -band_, band_);
  if (is_free)
    return {outside > 0.0F ? outside : band_, Support::free};  // the hull gives the distance outside more exactly
  return {outside, Support::bounds};
}

/// The class and D of one pose from its N0 = N/2 views nearest in azimuth to the outward direction.
PoseDistance Field::pose_distance(const Eigen::Vector3f& point, std::size_t pose) const {
  const auto& views = views_of_pose_[pose];
  const Eigen::Vector3d p = point.cast<double>();
  const auto horizontal = [&](const Eigen::Vector3d& direction) {
    Eigen::Vector3d d = pose_from_model_[pose].linear() * direction;
    d.y() = 0.0;
    return d.norm() > 0.0 ? Eigen::Vector3d(d.normalized()) : d;
  };
  const Eigen::Vector3d outward = horizontal(p - centre_);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < views.size(); ++i) {
    order.emplace_back(-outward.dot(horizontal(views[i].sampler.towards_camera(centre_))), i);
  }
  std::sort(order.begin(), order.end());
  order.resize((views.size() + 1) / 2);
  std::vector<ViewDistance> distances;
  for (const auto& [cosine, i] : order) {
    const RangeSample s = views[i].sampler.sample(point);
    if (s.kind != RangeSample::Kind::none) distances.push_back({s.distance, s.weight, s.sigma});
  }
  return classify(distances, class_threshold_);
}

FieldValue Field::from_class_table(const Eigen::Vector3f& point, const Neighbourhood& neighbourhood) const {
  PoseDistance value = pose_distance(point, 0);
  bool measured = value.surface_views > 0;
  if (poses() == 2) {
    const PoseDistance other = pose_distance(point, 1);
    measured = measured || other.surface_views > 0;
    const bool unseen = value.voxel_class == VoxelClass::unseen && other.voxel_class == VoxelClass::unseen;
    if (!unseen) {
      value.distance = combine(value, other, class_threshold_).distance;
      value.voxel_class = VoxelClass::overlap;
    }
  }
  const float outside = bounds(point, neighbourhood, 0);
  if (value.voxel_class == VoxelClass::unseen) return {std::clamp(outside, -band_, band_), Support::bounds};
  const float distance = std::clamp(std::max(value.distance, outside - hull_tolerance_), -band_, band_);
  if (measured) return {distance, Support::measured};
  return {std::clamp(std::max(distance, outside), -band_, band_), distance > 0.0F ? Support::free : Support::bounds};
}

PointEvidence Field::evidence_at(const Eigen::Vector3f& point) const {
  PointEvidence result;
  std::vector<WeightedDistance> counted;
  float weight = 0.0F, sum = 0.0F, variance = 0.0F;
  for (const auto& views : views_of_pose_) {
    for (const auto& [view, part] : views) {
      const RangeSample s = view.sample(point);
      if (s.kind != RangeSample::Kind::surface) continue;
      const float w = s.weight * taper(s.distance, band_);
      weight += w;
      sum += w * s.distance;
      variance += w * w * s.sigma * s.sigma;
      result.normal += w * s.normal;
      if (std::abs(s.distance) < std::max(class_threshold_, view_sigmas_ * s.sigma)) {
        ++result.views;
        counted.push_back({s.distance, s.sigma, w});
      }
    }
  }
  if (!(weight > 0.0F)) return result;
  result.surface_distance = sum / weight;
  result.normal.normalize();
  result.sigma = std::sqrt(variance) / weight;
  result.scatter = scatter_of(counted);
  return result;
}

}  // namespace scanrig
