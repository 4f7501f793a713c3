#include "pipeline/volume/handles.h"

#include <gtest/gtest.h>

#include <deque>
#include <functional>

#include "pipeline/mesh/topology.h"
#include "pipeline/volume/marching_cubes.h"

namespace scanrig {
namespace {

constexpr float kCubeVoxelMm = 0.5F, kBandMm = 1.5F;
constexpr int kCubeSide = 48;  // voxels

using IsSolid = std::function<bool(int x, int y, int z)>;

bool is_within(int value, int low, int high) { return value >= low && value < high; }

/// Two posts on a slab, 20 voxels apart.
bool posts(int x, int y, int z) {
  if (!is_within(z, 10, 20) || !is_within(x, 4, 44)) return false;
  return is_within(y, 4, 12) || (is_within(y, 4, 40) && (x < 14 || x >= 34));
}

/// All nodes of it with one origin.
BlockGrid grid_of(const IsSolid& is_solid, Support support) {
  BlockGrid grid(Eigen::AlignedBox3f(Eigen::Vector3f::Zero(), Eigen::Vector3f::Constant(kCubeSide * kCubeVoxelMm)),
                 kCubeVoxelMm);
  for (int i = 0; i < kCubeSide * kCubeSide * kCubeSide; ++i) {
    const int x = i % kCubeSide, y = i / kCubeSide % kCubeSide, z = i / (kCubeSide * kCubeSide);
    grid.set({x, y, z}, is_solid(x, y, z) ? -0.5F * kCubeVoxelMm : 0.5F * kCubeVoxelMm, kBandMm);
  }
  for (auto& block : grid.blocks()) block.support.fill(support);
  return grid;
}

HandleRepair repaired(const IsSolid& is_solid, Support support = Support::measured) {
  BlockGrid grid = grid_of(is_solid, support);
  Mesh surface = extract_surface(grid);
  const long genus = genus_of_largest(surface);
  EXPECT_EQ(genus, 1);
  const HandleRepair repair = repair_handles(grid, surface, genus, kBandMm, {.voxel_mm = kCubeVoxelMm});
  EXPECT_EQ(genus_of_largest(surface), repair.genus);
  return repair;
}

/// A bridge of `thickness` voxels across a hole of `width`, in the corner of post and slab.
IsSolid corner_bridge(int width, int thickness) {
  return [=](int x, int y, int z) {
    if (posts(x, y, z)) return true;
    const int from_post = x - 14, from_slab = y - 12, outer = width + thickness;
    const bool is_arch =
        is_within(from_post, 0, outer) && is_within(from_slab, 0, outer) && (from_post >= width || from_slab >= width);
    return is_arch && is_within(z, 14, 14 + thickness);
  };
}

TEST(Handles, AThinOneWithAShortLoopIsCutAlthoughMeasured) {
  const HandleRepair repair = repaired(corner_bridge(3, 2));
  EXPECT_EQ(repair.genus, 0);
  EXPECT_GT(repair.cut, 0U);
  EXPECT_LE(repair.cut, 8U);
  EXPECT_EQ(repair.filled, 0U);
}

TEST(Handles, AThinOneWithALongLoopStays) { EXPECT_EQ(repaired(corner_bridge(12, 2)).genus, 1); }

TEST(Handles, AGridWhoseNodeIsSetBackIsAsItWas) {
  BlockGrid grid = grid_of(posts, Support::measured);
  const std::size_t blocks = grid.blocks().size();
  const std::deque<BlockGrid::Block> before = grid.blocks();
  const Eigen::Vector3i far(kCubeSide + 12, 20, 20);
  const float distance = grid.set(far, -1.0F, kBandMm);
  EXPECT_EQ(distance, kBandMm);
  EXPECT_GT(grid.blocks().size(), blocks);
  EXPECT_EQ(grid.set(far, distance, kBandMm), -1.0F);
  grid.forget_blocks_after(blocks);
  ASSERT_EQ(grid.blocks().size(), blocks);
  EXPECT_EQ(grid.find(far / kBlockSide), nullptr);
  EXPECT_FALSE(grid.all_inside(far / kBlockSide));
  for (std::size_t i = 0; i < blocks; ++i) EXPECT_EQ(grid.blocks()[i].distance, before[i].distance);
}

TEST(Handles, AThickOneWithAShortLoopStays) { EXPECT_EQ(repaired(corner_bridge(3, 7)).genus, 1); }

/// A beam from post to post, 3 voxels thick, `width` above the slab.
IsSolid beam_above(int width) {
  return [=](int x, int y, int z) {
    return posts(x, y, z) || (is_within(x, 14, 34) && is_within(y, 12 + width, 15 + width) && is_within(z, 14, 17));
  };
}

TEST(Handles, AThinTunnelIsFilledUnlessAViewLookedThroughIt) {
  const HandleRepair repair = repaired(beam_above(2));
  EXPECT_EQ(repair.genus, 0);
  EXPECT_GT(repair.filled, 0U);
  EXPECT_EQ(repair.cut, 0U);
  EXPECT_EQ(repaired(beam_above(2), Support::free).genus, 1);
}

TEST(Handles, ATunnelThatIsResolvedStays) { EXPECT_EQ(repaired(beam_above(8)).genus, 1); }

}  // namespace
}  // namespace scanrig
