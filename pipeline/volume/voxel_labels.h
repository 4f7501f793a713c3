#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "pipeline/volume/block_grid.h"

namespace scanrig {

/// One byte per voxel over the stored blocks and the space between them, with a rim of outside voxels.
class VoxelLabels {
 public:
  enum Flag : std::uint8_t { kInside = 1, kDoubtful = 2, kGrown = 4, kQueued = 8, kRim = 16 };

  /// `doubt_reach_mm`: the solid is doubtful this deep below a closed surface. Space that a view looked through is
  /// certain.
  VoxelLabels(const BlockGrid& grid, float doubt_reach_mm);

  [[nodiscard]] std::uint8_t at(std::size_t i) const { return flags_[i]; }
  [[nodiscard]] bool has(std::size_t i, Flag flag) const { return (flags_[i] & flag) != 0; }
  [[nodiscard]] std::size_t count() const { return flags_.size(); }
  [[nodiscard]] Eigen::Vector3i node(std::size_t i) const;  ///< of the grid
  [[nodiscard]] bool on_rim(std::size_t i) const { return has(i, kRim); }

  /// Distances, in voxels, from index to index along the axes.
  [[nodiscard]] std::ptrdiff_t step(int dx, int dy, int dz) const {
    return (static_cast<std::ptrdiff_t>(dz) * size_.y() + dy) * size_.x() + dx;
  }

  /// Grows the set of inside (or outside) voxels from its certain ones; returns the voxels that would have closed a
  /// loop, in the order of their indices.
  std::vector<std::size_t> grow(bool inside);

 private:
  struct Run {
    std::size_t first, last;  ///< indices along x, both included
  };
  struct Runs {
    std::vector<Run> runs;
    std::vector<std::uint32_t> root;  ///< of each run's component
  };
  void mark_rim();
  void mark_doubtful(const BlockGrid& grid, float doubt_reach_mm);
  [[nodiscard]] Runs certain_runs(bool inside) const;
  [[nodiscard]] bool is_in(std::size_t i, bool inside) const { return has(i, kInside) == inside; }

  Eigen::Vector3i first_;  ///< node of the first voxel
  Eigen::Vector3i size_;
  std::vector<std::uint8_t> flags_;
};

}  // namespace scanrig
