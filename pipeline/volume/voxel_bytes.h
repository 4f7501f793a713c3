#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "pipeline/volume/block_grid.h"

namespace scanrig {

/// A byte per voxel of a box of blocks. A block whose voxels are all alike takes no page of memory.
/// Indices follow z, then y, then x, with gaps: equal steps in space are equal steps of the index.
/// Threads: const functions from any; those that write one voxel or block, from any for different blocks.
class VoxelBytes {
 public:
  /// All 0.
  explicit VoxelBytes(const Eigen::Vector3i& blocks);

  [[nodiscard]] const Eigen::Vector3i& blocks() const { return blocks_; }
  [[nodiscard]] std::size_t block_count() const { return values_.size(); }
  [[nodiscard]] std::size_t block_at(const Eigen::Vector3i& b) const {
    return (static_cast<std::size_t>(b.z()) * blocks_.y() + b.y()) * blocks_.x() + b.x();
  }
  [[nodiscard]] std::ptrdiff_t step(int dx, int dy, int dz) const {
    const std::ptrdiff_t row = std::ptrdiff_t{1} << x_bits_, slice = row << y_bits_;
    return dz * slice + dy * row + dx;
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector3i& voxel) const {
    return static_cast<std::size_t>(step(voxel.x(), voxel.y(), voxel.z()));
  }
  [[nodiscard]] Eigen::Vector3i voxel(std::size_t i) const {
    return {static_cast<int>(x_of(i)), static_cast<int>(y_of(i)), static_cast<int>(z_of(i))};
  }
  /// The block that holds a voxel.
  [[nodiscard]] std::size_t block_of(std::size_t i) const {
    const auto width = static_cast<std::size_t>(blocks_.x()), height = static_cast<std::size_t>(blocks_.y());
    return (z_of(i) / kBlockSide * height + y_of(i) / kBlockSide) * width + x_of(i) / kBlockSide;
  }

  [[nodiscard]] std::uint8_t at(std::size_t i) const {
    const std::size_t block = block_of(i);
    return pages_[block] ? (*pages_[block])[place_of(i)] : values_[block];
  }
  /// The byte of all voxels of a block without a page.
  [[nodiscard]] std::optional<std::uint8_t> common(std::size_t block) const {
    return pages_[block] ? std::nullopt : std::optional(values_[block]);
  }
  void set_bits(std::size_t i, std::uint8_t bits) {
    if ((at(i) & bits) != bits) writable(i) |= bits;
  }
  void clear_bits(std::size_t i, std::uint8_t bits) {
    if ((at(i) & bits) != 0) writable(i) &= static_cast<std::uint8_t>(~bits);
  }
  /// All voxels of a block; its page is released.
  void fill_block(std::size_t block, std::uint8_t value);
  void clear_bits_everywhere(std::uint8_t bits);
  /// Those of blocks whose voxels have become alike.
  void release_pages();
  [[nodiscard]] std::size_t page_count() const;

 private:
  using Page = std::array<std::uint8_t, BlockGrid::kNodes>;

  [[nodiscard]] std::size_t x_of(std::size_t i) const { return i & ((std::size_t{1} << x_bits_) - 1); }
  [[nodiscard]] std::size_t y_of(std::size_t i) const { return i >> x_bits_ & ((std::size_t{1} << y_bits_) - 1); }
  [[nodiscard]] std::size_t z_of(std::size_t i) const { return i >> (x_bits_ + y_bits_); }
  [[nodiscard]] std::size_t place_of(std::size_t i) const {
    return (z_of(i) % kBlockSide * kBlockSide + y_of(i) % kBlockSide) * kBlockSide + x_of(i) % kBlockSide;
  }
  std::uint8_t& writable(std::size_t i);

  Eigen::Vector3i blocks_;
  int x_bits_, y_bits_;  ///< of an index
  std::vector<std::unique_ptr<Page>> pages_;
  std::vector<std::uint8_t> values_;  ///< of blocks without a page
};

}  // namespace scanrig
