#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/volume/block_grid.h"
#include "pipeline/volume/voxel_bytes.h"

namespace scanrig {

/// Flags of each voxel over the stored blocks and the space between them, with a rim of outside blocks.
class VoxelLabels {
 public:
  enum Flag : std::uint8_t {
    kInside = 1,
    kDoubtful = 2,
    kGrown = 4,
    kQueued = 8,
    kRim = 16,
    kReached = 32,
    kThick = 64
  };

  /// Nothing is doubtful.
  explicit VoxelLabels(const BlockGrid& grid);

  /// Every voxel is as certain as the piece of surface nearest to it, down to `reach_mm`: nothing measured a closed
  /// surface. Space that a view looked through is certain.
  void doubt_unmeasured(const BlockGrid& grid, float reach_mm);
  /// Solid and space that are not more than 2 `layers` of voxels thick; space that a view looked through is certain.
  void doubt_thin(const BlockGrid& grid, int layers);

  [[nodiscard]] bool has(std::size_t i, Flag flag) const { return (flags_.at(i) & flag) != 0; }
  [[nodiscard]] Eigen::Vector3i node(std::size_t i) const { return first_ + flags_.voxel(i); }  ///< of the grid
  [[nodiscard]] bool on_rim(std::size_t i) const { return has(i, kRim); }

  /// Distances, in voxels, from index to index along the axes.
  [[nodiscard]] std::ptrdiff_t step(int dx, int dy, int dz) const { return flags_.step(dx, dy, dz); }

  /// Grows the set of inside (or outside) voxels from its certain ones; returns the voxels that would have closed a
  /// loop, in the order of their indices.
  std::vector<std::size_t> grow(bool inside);
  /// After `grow`: does a loop of fewer than `longest` voxels, joined as the set is (solid through edges too, space
  /// through faces), pass through a voxel that would have closed it?
  [[nodiscard]] bool closes_short_loop(std::size_t blocked, bool inside, int longest) const;

 private:
  class Growth;
  /// `body(i, block, n)`: of each voxel of the stored blocks.
  template <class Body>
  void for_each_stored(const BlockGrid& grid, const Body& body) const;
  [[nodiscard]] std::array<std::ptrdiff_t, 6> faces() const;
  std::vector<std::size_t> next_layer(const std::vector<std::size_t>& front);
  [[nodiscard]] static bool is_certain(std::uint8_t flags, bool inside) {
    return ((flags & kInside) != 0) == inside && (flags & kDoubtful) == 0;
  }

  Eigen::Vector3i first_;  ///< node of the first voxel
  VoxelBytes flags_;
};

}  // namespace scanrig
