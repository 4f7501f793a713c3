#include "pipeline/volume/voxel_bytes.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

constexpr std::uint8_t kLow = 1, kHigh = 8;

TEST(VoxelBytes, IndicesFollowTheVoxelsAndStepsAreEqualEverywhere) {
  const VoxelBytes bytes({2, 3, 5});
  std::size_t last = 0;
  for (int z = 0; z < 40; ++z) {
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 16; ++x) {
        const std::size_t i = bytes.index({x, y, z});
        ASSERT_TRUE(i > last || i == 0);
        ASSERT_EQ(bytes.voxel(i), Eigen::Vector3i(x, y, z));
        ASSERT_EQ(bytes.voxel(i + bytes.step(1 - x, 2 - y, 3 - z)), Eigen::Vector3i(1, 2, 3));
        ASSERT_EQ(bytes.block_of(i), bytes.block_at({x / 8, y / 8, z / 8}));
        last = i;
      }
    }
  }
}

TEST(VoxelBytes, AVoxelHasItsOwnBits) {
  VoxelBytes bytes({2, 3, 5});
  bytes.fill_block(bytes.block_at({1, 2, 4}), kHigh);
  const std::size_t i = bytes.index({15, 20, 39}), neighbour = bytes.index({15, 20, 38});
  bytes.set_bits(i, kLow);
  EXPECT_EQ(bytes.at(i), kLow | kHigh);
  EXPECT_EQ(bytes.at(neighbour), kHigh);
  EXPECT_EQ(bytes.at(bytes.index({7, 20, 39})), 0);
  bytes.clear_bits(i, kHigh);
  EXPECT_EQ(bytes.at(i), kLow);
  EXPECT_EQ(bytes.at(neighbour), kHigh);
}

TEST(VoxelBytes, OnlyBlocksOfUnlikeVoxelsTakeAPage) {
  VoxelBytes bytes({2, 3, 5});
  const std::size_t block = bytes.block_at({1, 1, 1}), i = bytes.index({8, 8, 8});
  bytes.fill_block(block, kLow);
  bytes.set_bits(i, kLow);
  bytes.clear_bits(i, kHigh);
  EXPECT_EQ(bytes.page_count(), 0U) << "nothing changed";
  bytes.set_bits(i, kHigh);
  EXPECT_EQ(bytes.page_count(), 1U);
  EXPECT_FALSE(bytes.common(block));
  bytes.release_pages();
  EXPECT_EQ(bytes.page_count(), 1U) << "one voxel differs";
  bytes.clear_bits_everywhere(kHigh);
  EXPECT_EQ(bytes.page_count(), 0U);
  EXPECT_EQ(bytes.common(block), kLow);
  EXPECT_EQ(bytes.at(i), kLow);
}

}  // namespace
}  // namespace scanrig
