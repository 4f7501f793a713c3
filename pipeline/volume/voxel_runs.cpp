#include "pipeline/volume/voxel_runs.h"

#include <numeric>

namespace scanrig {

VoxelRuns::VoxelRuns(const VoxelBytes& bytes, const std::function<bool(std::uint8_t)>& is_wanted) {
  collect(bytes, is_wanted);
  const auto count = static_cast<std::uint32_t>(runs_.size());
  root_.resize(count);
  std::iota(root_.begin(), root_.end(), 0U);
  const auto height = static_cast<std::size_t>(bytes.blocks().y()) * kBlockSide;
  for (std::size_t row = 0; row + 1 < row_start_.size(); ++row) {
    if (row % height != 0) join_rows(row, row - 1, bytes.step(0, 1, 0));
    if (row >= height) join_rows(row, row - height, bytes.step(0, 0, 1));
  }
  next_.assign(count, count);
  std::vector<std::uint32_t> last(count);  // of each root's component, so far
  for (std::uint32_t r = 0; r < count; ++r) {
    const std::uint32_t root = root_[r] = find(r);
    if (r != root) next_[last[root]] = r;
    last[root] = r;
  }
  row_start_ = std::vector<std::size_t>();
}

void VoxelRuns::collect(const VoxelBytes& bytes, const std::function<bool(std::uint8_t)>& is_wanted) {
  const Eigen::Vector3i size = kBlockSide * bytes.blocks();
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      row_start_.push_back(runs_.size());
      for (int x = 0; x < size.x(); x += kBlockSide) {
        const std::size_t i = bytes.index({x, y, z});
        if (const auto common = bytes.common(bytes.block_of(i))) {
          if (is_wanted(*common)) append(i, i + kBlockSide - 1);
          continue;
        }
        for (std::size_t j = i; j < i + kBlockSide; ++j) {
          if (is_wanted(bytes.at(j))) append(j, j);
        }
      }
    }
  }
  row_start_.push_back(runs_.size());
}

/// To the last run of the row, or as a new one.
void VoxelRuns::append(std::size_t first, std::size_t last) {
  if (runs_.size() > row_start_.back() && runs_.back().last + 1 == first) {
    runs_.back().last = last;
  } else {
    runs_.push_back({first, last});
  }
}

std::uint32_t VoxelRuns::find(std::uint32_t run) {
  while (root_[run] != run) run = root_[run] = root_[root_[run]];
  return run;
}

/// `other` comes before `row`.
void VoxelRuns::join_rows(std::size_t row, std::size_t other, std::ptrdiff_t shift) {
  std::size_t b = row_start_[other];
  for (std::size_t a = row_start_[row]; a < row_start_[row + 1]; ++a) {
    while (b < row_start_[other + 1] && runs_[b].last + shift < runs_[a].first) ++b;
    for (std::size_t c = b; c < row_start_[other + 1] && runs_[c].first + shift <= runs_[a].last; ++c) {
      const std::uint32_t x = find(static_cast<std::uint32_t>(a)), y = find(static_cast<std::uint32_t>(c));
      root_[std::max(x, y)] = std::min(x, y);
    }
  }
}

std::uint32_t VoxelRuns::largest() const {
  std::vector<std::size_t> voxels(runs_.size());
  for (std::size_t r = 0; r < runs_.size(); ++r) voxels[root_[r]] += runs_[r].last - runs_[r].first + 1;
  return static_cast<std::uint32_t>(std::max_element(voxels.begin(), voxels.end()) - voxels.begin());
}

std::uint32_t VoxelRuns::component_of(std::size_t i) const {
  const auto after =
      std::upper_bound(runs_.begin(), runs_.end(), i, [](std::size_t at, const Run& run) { return at < run.first; });
  return root_[static_cast<std::size_t>(after - runs_.begin()) - 1];
}

}  // namespace scanrig
