#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace scanrig {

/// Visibility of a voxel in the views of one pose [Park and Subbarao 2002, section 4]; `unseen` is ours: no view sees
/// it.
enum class VoxelClass : std::uint8_t { overlap, nonoverlap, inside, outside, unseen };
constexpr std::size_t kVoxelClasses = 5;

/// One view's signed distance to a voxel, mm, positive outside; +infinity where it sees through to the background.
struct ViewDistance {
  float distance = 0.0F;
  float weight = 0.0F;
  float sigma = 0.0F;
};

/// The state of a voxel in one pose.
struct PoseDistance {
  VoxelClass voxel_class = VoxelClass::unseen;
  float distance = 0.0F;        ///< the pose's signed distance D, mm
  float weight = 0.0F;          ///< of D, where views measured the surface here
  float positive_share = 0.0F;  ///< of the views, those that see the voxel in front of their surface
  int surface_views = 0;        ///< views with |d| < d_TH
};

/// The class and D from the views nearest in azimuth. `threshold_mm` is d_TH, raised to 4 sigma for a noisier view.
PoseDistance classify(std::span<const ViewDistance> views, float threshold_mm);

struct CombinedDistance {
  float distance = 0.0F;
  bool conflict = false;  ///< the poses contradict each other
};

/// The class table for two poses [section 4, with the cells filled in that the paper leaves open]. Where one pose does
/// not see the voxel, the other one's distance counts; one of them must see it.
CombinedDistance combine(const PoseDistance& a, const PoseDistance& b, float threshold_mm);

/// Number of voxels per pair of classes.
using ClassPairCounts = std::array<std::array<std::size_t, kVoxelClasses>, kVoxelClasses>;

}  // namespace scanrig
