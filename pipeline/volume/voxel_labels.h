#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/volume/block_grid.h"

namespace scanrig {

/// One byte per voxel over the stored blocks and the space between them, with a rim of outside voxels.
class VoxelLabels {
 public:
  enum Flag : std::uint8_t { kInside = 1, kDoubtful = 2, kGrown = 4, kQueued = 8, kRim = 16 };

  /// Nothing is doubtful.
  explicit VoxelLabels(const BlockGrid& grid);

  /// Every voxel is as certain as the piece of surface nearest to it, down to `reach_mm`: nothing measured a closed
  /// surface. Space that a view looked through is certain.
  void doubt_unmeasured(const BlockGrid& grid, float reach_mm);
  /// Solid and space that are not more than 2 `layers` of voxels thick; space that a view looked through is certain.
  void doubt_thin(const BlockGrid& grid, int layers);

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
  /// After `grow`: does a loop of fewer than `longest` voxels, joined as the set is (solid through edges too, space
  /// through faces), pass through a voxel that would have closed it?
  [[nodiscard]] bool closes_short_loop(std::size_t blocked, bool inside, int longest) const;

 private:
  struct Run {
    std::size_t first, last;  ///< indices along x, both included
  };
  struct Runs {
    std::vector<Run> runs;
    std::vector<std::uint32_t> root;  ///< of each run's component
  };
  void mark_rim();
  /// `body(i, block, n)`: of each voxel of the stored blocks.
  template <class Body>
  void for_each_stored(const BlockGrid& grid, const Body& body) const;
  [[nodiscard]] std::array<std::ptrdiff_t, 6> faces() const;
  [[nodiscard]] std::vector<std::size_t> next_layer(const std::vector<std::size_t>& front,
                                                    std::vector<std::uint8_t>& reached) const;
  [[nodiscard]] Runs certain_runs(bool inside) const;
  [[nodiscard]] bool is_in(std::size_t i, bool inside) const { return has(i, kInside) == inside; }

  Eigen::Vector3i first_;  ///< node of the first voxel
  Eigen::Vector3i size_;
  std::vector<std::uint8_t> flags_;
};

}  // namespace scanrig
