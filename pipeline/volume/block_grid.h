#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/context.h"
#include "core/max_poses.h"
#include "core/result.h"
#include "pipeline/volume/distance_field.h"

namespace scanrig {

inline constexpr int kBlockSide = 8;

/// Blocks of 8 x 8 x 8 nodes, stored only where the surface passes; every other block is all inside or all outside.
class BlockGrid {
 public:
  static constexpr int kNodes = kBlockSide * kBlockSide * kBlockSide;

  struct Block {
    Eigen::Vector3i index;  ///< of the block; its first node is kBlockSide times that
    std::array<float, kNodes> distance;
    std::array<Support, kNodes> support;
    /// In each pose, of a node in the middle; none of a block that a repair has added.
    std::array<std::optional<VoxelClass>, kMaxPoses> classes{};
    bool is_in_conflict = false;  ///< two of the poses contradict each other there
    [[nodiscard]] static int node(int x, int y, int z) { return (z * kBlockSide + y) * kBlockSide + x; }
  };

  /// Covers `box` with room around it.
  BlockGrid(const Eigen::AlignedBox3f& box, float voxel_mm);

  /// Stores the blocks around `seeds` and wherever the sign of `field` changes from block to block, then follows the
  /// surface from block to block until it is closed. Fails with `out_of_range`, `stopped`.
  Result<void> fill(Field& field, std::vector<Eigen::Vector3f> seeds, const Context& context);

  /// Gives one node a distance and returns the one it had; stores its block and the blocks it touches if they are
  /// missing.
  float set(const Eigen::Vector3i& node, float distance, float band_mm);
  /// No longer stores those blocks that were stored after the first `count`, each all inside or all outside again.
  void forget_blocks_after(std::size_t count);

  [[nodiscard]] const std::deque<Block>& blocks() const { return blocks_; }
  [[nodiscard]] std::deque<Block>& blocks() { return blocks_; }
  [[nodiscard]] const Eigen::Vector3i& size() const { return size_; }  ///< in blocks
  [[nodiscard]] float voxel() const { return voxel_; }
  [[nodiscard]] Eigen::Vector3f position(const Eigen::Vector3i& node) const {
    return origin_ + voxel_ * node.cast<float>();
  }
  /// The stored block, or null; also null outside the grid.
  [[nodiscard]] const Block* find(const Eigen::Vector3i& block) const;
  /// Place of a stored block in blocks().
  [[nodiscard]] std::size_t place(const Eigen::Vector3i& block) const {
    return static_cast<std::size_t>(slot_[linear(block)]);
  }
  /// Of a block that is not stored. Outside the grid everything is outside.
  [[nodiscard]] bool all_inside(const Eigen::Vector3i& block) const;

 private:
  static constexpr std::int32_t kOutside = -1, kInside = -2;
  [[nodiscard]] bool contains(const Eigen::Vector3i& block) const {
    return (block.array() >= 0).all() && (block.array() < size_.array()).all();
  }
  [[nodiscard]] std::size_t linear(const Eigen::Vector3i& block) const {
    return (static_cast<std::size_t>(block.z()) * size_.y() + block.y()) * size_.x() + block.x();
  }
  Block& store(const Eigen::Vector3i& block, float band_mm);
  [[nodiscard]] Eigen::Vector3i block_at(std::size_t linear) const;
  void classify_blocks(Field& field);
  [[nodiscard]] std::vector<Eigen::Vector3i> seed_blocks(const std::vector<Eigen::Vector3f>& seeds) const;
  [[nodiscard]] std::vector<Eigen::Vector3i> open_neighbours(const Block& block) const;
  void evaluate(const Field& field, Block& block) const;
  bool interpolate_far_node(Block& block, const Eigen::Vector3i& node) const;
  void follow(std::vector<Eigen::Vector3i> wanted, const Bricks& bricks, std::size_t brick, const Field& field,
              const Context& context, std::vector<bool>& is_queued, std::vector<std::vector<Eigen::Vector3i>>& queue);

  Eigen::Vector3f origin_;
  float voxel_;
  Eigen::Vector3i size_;
  std::vector<std::int32_t> slot_;  ///< one per block: its place in blocks_, or its kind
  std::deque<Block> blocks_;        ///< gigabytes, that a vector would copy to grow
};

}  // namespace scanrig
