#include "pipeline/volume/prepare_views.h"

#include <algorithm>
#include <optional>

#include "core/parallel.h"

namespace scanrig {
namespace {

/// A view on its way into the field.
struct MadeView {
  std::optional<RangeSampler> sampler;
  std::vector<Eigen::Vector3f> seeds;
  Eigen::AlignedBox3f box;
  std::vector<float> weights;  ///< of one point in `Strides::weights`
  std::size_t points = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
};

/// One point in so many.
struct Strides {
  std::size_t seeds, weights;
};

RangeSampler::PartSource part_of(const PosedViews& pose, std::size_t v) {
  if (!pose.full.empty()) return [full = &pose.full[v]](const cv::Rect& box) { return full->part(box); };
  return [range = &pose.views[v].range](const cv::Rect& box) {
    RangeImage part;
    part.depth = range->depth(box);
    part.sigma = range->sigma(box);
    part.normal = range->normal(box);
    if (!range->background.empty()) part.background = range->background(box);
    return part;
  };
}

std::uintmax_t pixels_of(const PosedViews& pose, std::size_t v) {
  const Projection& p = pose.full.empty() ? pose.views[v].range.projection : pose.full[v].header().projection;
  return static_cast<std::uintmax_t>(p.width) * static_cast<std::uintmax_t>(p.height);
}

MadeView make_one(const PosedViews& pose, std::size_t v, const VolumeOptions& options, const Strides& strides,
                  double band_mm) {
  MadeView made;
  const RangeImage expanded = pose.full.empty() ? RangeImage() : pose.full[v].whole();
  made.sampler.emplace(pose.full.empty() ? pose.views[v].range : expanded, pose.model_from_pose, band_mm,
                       options.voxel_mm, options.sampler);
  for (const auto& pixel : made.sampler->surface()) {
    made.box.extend(pixel.point);
    if (made.points % strides.seeds == 0) made.seeds.push_back(pixel.point);
    if (made.points % strides.weights == 0) made.weights.push_back(pixel.weight);
    made.sum += pixel.point.cast<double>();
    ++made.points;
  }
  return made;
}

SurfaceStatistics statistics_of(std::vector<float>& weights, const Eigen::Vector3d& sum, std::size_t points) {
  SurfaceStatistics result;
  if (weights.empty()) return result;
  result.centre = sum / static_cast<double>(points);
  const auto middle = weights.begin() + static_cast<std::ptrdiff_t>(weights.size() / 2);
  std::nth_element(weights.begin(), middle, weights.end());
  result.median_weight = *middle;
  return result;
}

}  // namespace

PreparedViews prepare_views(std::span<const PosedViews> poses, const VolumeOptions& options, double band_mm) {
  constexpr std::uintmax_t kWhilePrepared = 3;            // times what a prepared view keeps
  constexpr std::uintmax_t kEnoughWeights = 1ULL << 24U;  // for their median
  const std::uintmax_t bytes = options.memory_bytes / 2;
  PreparedViews result;
  std::uintmax_t pixels = 0, largest = 1;
  for (const auto& pose : poses) {
    for (std::size_t v = 0; v < pose.views.size(); ++v) {
      pixels += pixels_of(pose, v);
      largest = std::max(largest, pixels_of(pose, v));
    }
  }
  largest *= RangeSampler::kBytesPerPixel;
  result.are_held = pixels * RangeSampler::kBytesPerPixel <= bytes;
  const Strides strides{options.seed_stride, static_cast<std::size_t>(pixels / kEnoughWeights + 1)};
  std::vector<float> weights;
  std::size_t points = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& pose : poses) {
    auto& views = result.views_of_pose.emplace_back();
    result.model_from_pose.push_back(pose.model_from_pose);
    const std::size_t count = pose.views.size();
    const std::size_t at_once =
        result.are_held
            ? count
            : static_cast<std::size_t>(std::clamp<std::uintmax_t>(bytes / (kWhilePrepared * largest), 1, count));
    for (std::size_t first = 0; first < count; first += at_once) {
      std::vector<MadeView> made(std::min(at_once, count - first));
      parallel_for(made.size(), [&](std::size_t i) {
        made[i] = make_one(pose, first + i, options, strides, band_mm);
        if (!result.are_held) made[i].sampler->release();
      });
      for (std::size_t i = 0; i < made.size(); ++i) {
        views.push_back({std::move(*made[i].sampler), part_of(pose, first + i)});
        result.box.extend(made[i].box);
        result.seeds.insert(result.seeds.end(), made[i].seeds.begin(), made[i].seeds.end());
        weights.insert(weights.end(), made[i].weights.begin(), made[i].weights.end());
        points += made[i].points;
        sum += made[i].sum;
        made[i] = {};
      }
    }
  }
  result.statistics = statistics_of(weights, sum, points);
  return result;
}

}  // namespace scanrig
