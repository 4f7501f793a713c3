#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/volume/voxel_bytes.h"

namespace scanrig {

/// Voxels whose bytes are of a kind as runs along x, joined into components through their faces. A component is named
/// by its first run. The bytes are read by the constructor only.
class VoxelRuns {
 public:
  VoxelRuns(const VoxelBytes& bytes, const std::function<bool(std::uint8_t)>& is_wanted);

  [[nodiscard]] bool empty() const { return runs_.empty(); }
  /// The component of most voxels, the first of those. Not of no voxels at all.
  [[nodiscard]] std::uint32_t largest() const;
  /// Of a voxel in a run.
  [[nodiscard]] std::uint32_t component_of(std::size_t i) const;

  /// `body(first, last)`: indices of a component's voxels, along x within one block, in order.
  template <class Body>
  void for_each_part(std::uint32_t component, const Body& body) const {
    for (std::size_t r = component; r < runs_.size(); r = next_[r]) {
      for (std::size_t first = runs_[r].first; first <= runs_[r].last;) {  // a block starts at a multiple of its side
        const std::size_t last = std::min(runs_[r].last, first - first % kBlockSide + kBlockSide - 1);
        body(first, last);
        first = last + 1;
      }
    }
  }

 private:
  struct Run {
    std::size_t first, last;  ///< indices along x, both included
  };
  void collect(const VoxelBytes& bytes, const std::function<bool(std::uint8_t)>& is_wanted);
  void append(std::size_t first, std::size_t last);
  [[nodiscard]] std::uint32_t find(std::uint32_t run);
  void join_rows(std::size_t row, std::size_t other, std::ptrdiff_t shift);

  std::vector<Run> runs_;
  std::vector<std::size_t> row_start_;  ///< first run of each row
  std::vector<std::uint32_t> root_;     ///< of each run: the first of its component
  std::vector<std::uint32_t> next_;     ///< of the component, after each run; the number of runs after the last
};

}  // namespace scanrig
