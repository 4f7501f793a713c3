#include "pipeline/volume/class_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanrig {
namespace {

float weighted_mean(const PoseDistance& a, float distance_a, const PoseDistance& b, float distance_b) {
  const float sum = a.weight + b.weight;
  return sum > 0.0F ? (a.weight * distance_a + b.weight * distance_b) / sum : 0.5F * (distance_a + distance_b);
}

CombinedDistance overlap_with_outside(const PoseDistance& overlap, const PoseDistance& outside, float threshold) {
  if (overlap.distance >= 0.0F) return {std::min(overlap.distance, threshold), false};
  return {weighted_mean(overlap, overlap.distance, outside, std::min(outside.distance, threshold)), true};
}

CombinedDistance overlap_with_nonoverlap(const PoseDistance& overlap, const PoseDistance& other, float threshold) {
  if (std::abs(overlap.distance - other.distance) >= threshold) return {overlap.distance, false};
  return {weighted_mean(overlap, overlap.distance, other, other.distance), false};
}

CombinedDistance both_nonoverlap(const PoseDistance& a, const PoseDistance& b) {
  if (a.positive_share != b.positive_share) {
    return {a.positive_share > b.positive_share ? a.distance : b.distance, false};
  }
  const float size_a = std::abs(a.distance), size_b = std::abs(b.distance);
  if (size_a != size_b) return {size_a < size_b ? a.distance : b.distance, false};
  return {std::max(a.distance, b.distance), false};
}

/// The cells on and above the diagonal; `a` has the lower class.
CombinedDistance combine_ordered(const PoseDistance& a, const PoseDistance& b, float threshold) {
  using enum VoxelClass;
  if (b.voxel_class == unseen) return {a.distance, false};
  switch (a.voxel_class) {
    case overlap:
      if (b.voxel_class == overlap) return {weighted_mean(a, a.distance, b, b.distance), false};
      if (b.voxel_class == nonoverlap) return overlap_with_nonoverlap(a, b, threshold);
      if (b.voxel_class == inside) return {a.distance, false};
      return overlap_with_outside(a, b, threshold);
    case nonoverlap:
      if (b.voxel_class == nonoverlap) return both_nonoverlap(a, b);
      if (b.voxel_class == inside) return {a.distance, false};
      return {b.distance, a.surface_views == 1};
    case inside:
      if (b.voxel_class == inside) return {-std::min(std::abs(a.distance), std::abs(b.distance)), false};
      return {b.distance, false};
    default: return {std::min(a.distance, b.distance), false};
  }
}

}  // namespace

PoseDistance classify(std::span<const ViewDistance> views, float threshold_mm) {
  PoseDistance result;
  if (views.empty()) return result;
  float sum = 0.0F, lowest = std::numeric_limits<float>::infinity(), greatest = -lowest, positive = 0.0F;
  float smallest = lowest;  // |d| among the views that do not see the voxel deeply occluded
  float nonoverlap = 0.0F;
  std::size_t outside = 0, inside = 0;
  for (const auto& view : views) {
    const float d = view.distance, threshold = std::max(threshold_mm, 4.0F * view.sigma);
    if (std::abs(d) < threshold) {
      ++result.surface_views;
      result.weight += view.weight;
      sum += view.weight * d;
    }
    if (d > threshold) ++outside;
    if (d < -threshold) ++inside;
    if (d > 0.0F) positive += 1.0F;
    lowest = std::min(lowest, d);
    greatest = std::max(greatest, d);
    if (d >= -threshold && std::abs(d) < smallest) {
      smallest = std::abs(d);
      nonoverlap = d;
    }
  }
  result.positive_share = positive / static_cast<float>(views.size());
  if (result.surface_views >= 2) {
    result.voxel_class = VoxelClass::overlap;
    result.distance = sum / result.weight;
  } else if (outside == views.size()) {
    result.voxel_class = VoxelClass::outside;
    result.distance = lowest;
  } else if (inside == views.size()) {
    result.voxel_class = VoxelClass::inside;
    result.distance = greatest;
  } else {
    result.voxel_class = VoxelClass::nonoverlap;
    result.distance = std::isinf(smallest) ? smallest : nonoverlap;
  }
  return result;
}

CombinedDistance combine(const PoseDistance& a, const PoseDistance& b, float threshold_mm) {
  return a.voxel_class <= b.voxel_class ? combine_ordered(a, b, threshold_mm) : combine_ordered(b, a, threshold_mm);
}

}  // namespace scanrig
