#include "pipeline/volume/voxel_labels.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "core/parallel.h"

namespace scanrig {
namespace {

/// The 26 neighbours of a voxel; which of them touch each other by faces (6) or by faces and edges (18).
struct Neighbourhood {
  std::array<Eigen::Vector3i, 26> offset;
  std::array<std::uint32_t, 26> touching6{}, touching18{};
  std::uint32_t around6 = 0, around18 = 0;  ///< those that touch the voxel itself

  Neighbourhood() {
    std::size_t n = 0;
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
          if (x != 0 || y != 0 || z != 0) offset[n++] = {x, y, z};
        }
      }
    }
    for (std::size_t a = 0; a < 26; ++a) {
      if (offset[a].squaredNorm() == 1) around6 |= 1U << a;
      if (offset[a].squaredNorm() <= 2) around18 |= 1U << a;
      for (std::size_t b = 0; b < 26; ++b) {
        const Eigen::Vector3i d = (offset[a] - offset[b]).cwiseAbs();
        if (d.maxCoeff() > 1 || a == b) continue;
        if (d.sum() == 1) touching6[a] |= 1U << b;
        if (d.sum() <= 2) touching18[a] |= 1U << b;
      }
    }
  }
};

const Neighbourhood& neighbourhood() {
  static const Neighbourhood instance;
  return instance;
}

/// Components of `members` among the 26 neighbours that touch the voxel in the middle.
int components_around(std::uint32_t members, bool inside) {
  const Neighbourhood& n = neighbourhood();
  const auto& touching = inside ? n.touching18 : n.touching6;
  std::uint32_t left = members & (inside ? n.around18 : n.around6);
  int count = 0;
  while (left != 0) {
    std::uint32_t component = left & -left, front = component;
    while (front != 0) {
      const auto voxel = static_cast<std::size_t>(std::countr_zero(front));
      front &= front - 1;
      const std::uint32_t fresh = touching[voxel] & members & ~component;
      component |= fresh;
      front |= fresh;
    }
    left &= ~component;
    ++count;
  }
  return count;
}

}  // namespace

VoxelLabels::VoxelLabels(const BlockGrid& grid, float doubt_reach_mm) {
  Eigen::Vector3i low = grid.size(), high = Eigen::Vector3i::Zero();
  for (const auto& block : grid.blocks()) {
    low = low.cwiseMin(block.index);
    high = high.cwiseMax(block.index);
  }
  first_ = kBlockSide * low - Eigen::Vector3i::Ones();
  size_ = kBlockSide * (high - low + Eigen::Vector3i::Ones()) + Eigen::Vector3i::Constant(2);
  flags_.assign(static_cast<std::size_t>(size_.x()) * size_.y() * size_.z(), 0);
  const Eigen::Vector3i blocks = high - low + Eigen::Vector3i::Ones();
  parallel_for(static_cast<std::size_t>(blocks.z()), [&](std::size_t layer) {
    Eigen::Vector3i b(0, 0, static_cast<int>(layer));
    for (b.y() = 0; b.y() < blocks.y(); ++b.y()) {
      for (b.x() = 0; b.x() < blocks.x(); ++b.x()) {
        const auto* block = grid.find(low + b);
        if (block == nullptr && !grid.all_inside(low + b)) continue;
        const Eigen::Vector3i corner = kBlockSide * b + Eigen::Vector3i::Ones();
        for (int n = 0; n < BlockGrid::kNodes; ++n) {
          const Eigen::Vector3i p =
              corner + Eigen::Vector3i(n % kBlockSide, n / kBlockSide % kBlockSide, n / (kBlockSide * kBlockSide));
          if (block == nullptr || block->distance[n] < 0.0F) flags_[step(p.x(), p.y(), p.z())] = kInside;
        }
      }
    }
  });
  mark_rim();
  mark_doubtful(grid, doubt_reach_mm);
}

Eigen::Vector3i VoxelLabels::node(std::size_t i) const {
  const auto width = static_cast<std::size_t>(size_.x()), height = static_cast<std::size_t>(size_.y());
  return first_ + Eigen::Vector3i(static_cast<int>(i % width), static_cast<int>(i / width % height),
                                  static_cast<int>(i / (width * height)));
}

void VoxelLabels::mark_rim() {
  const Eigen::Vector3i last = size_ - Eigen::Vector3i::Ones();
  for (int z = 0; z <= last.z(); ++z) {
    for (int y = 0; y <= last.y(); ++y) {
      const bool whole = z == 0 || z == last.z() || y == 0 || y == last.y();
      for (int x = 0; x <= last.x(); x += whole ? 1 : last.x()) flags_[step(x, y, z)] |= kRim;
    }
  }
}

/// Every voxel is as certain as the piece of surface nearest to it, up to a depth.
void VoxelLabels::mark_doubtful(const BlockGrid& grid, float doubt_reach_mm) {
  const std::array<std::ptrdiff_t, 6> faces = {step(1, 0, 0),  step(-1, 0, 0), step(0, 1, 0),
                                               step(0, -1, 0), step(0, 0, 1),  step(0, 0, -1)};
  const auto is_measured = [&](std::size_t i) {
    const Eigen::Vector3i n = node(i);
    const auto* block = grid.find(n.unaryExpr([](int c) { return c / kBlockSide; }));
    const Eigen::Vector3i local = n.unaryExpr([](int c) { return c % kBlockSide; });
    return block != nullptr &&
           block->support[BlockGrid::Block::node(local.x(), local.y(), local.z())] == Support::measured;
  };
  std::vector<std::size_t> certain, doubtful;
  for (const auto& block : grid.blocks()) {
    for (int n = 0; n < BlockGrid::kNodes; ++n) {
      const Eigen::Vector3i p =
          kBlockSide * block.index - first_ +
          Eigen::Vector3i(n % kBlockSide, n / kBlockSide % kBlockSide, n / (kBlockSide * kBlockSide));
      const auto i = static_cast<std::size_t>(step(p.x(), p.y(), p.z()));
      bool surface = false, measured = false;  // both ends of a cut edge must be
      for (const auto face : faces) {
        if (has(i + face, kInside) == has(i, kInside)) continue;
        surface = true;
        measured = measured || (block.support[n] == Support::measured && is_measured(i + face));
      }
      // What views looked through is open, however narrow: no repair may fill it.
      const bool is_open = !has(i, kInside) && block.support[n] == Support::free;
      if (surface || is_open) (measured || is_open ? certain : doubtful).push_back(i);
    }
  }
  std::vector<std::uint8_t> reached(flags_.size());
  for (const auto i : certain) reached[i] = 1;
  for (const auto i : doubtful) reached[i] = 2;
  const int depth = static_cast<int>(doubt_reach_mm / grid.voxel());
  for (int layer = 0; layer < depth && !doubtful.empty(); ++layer) {
    for (auto* front : {&certain, &doubtful}) {
      std::vector<std::size_t> next;
      for (const auto i : *front) {
        if (on_rim(i)) continue;
        for (const auto face : faces) {
          const std::size_t j = i + face;
          if (reached[j] != 0 || has(j, kInside) != has(i, kInside)) continue;
          reached[j] = reached[i];
          next.push_back(j);
        }
      }
      *front = std::move(next);
    }
  }
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    if (reached[i] == 2 && !on_rim(i)) flags_[i] |= kDoubtful;
  }
}

/// Certain voxels of a set as runs along x, joined into components through their faces.
VoxelLabels::Runs VoxelLabels::certain_runs(bool inside) const {
  Runs result;
  std::vector<std::size_t> row_start;  // first run of each row
  const auto width = static_cast<std::size_t>(size_.x());
  const auto wanted = [&](std::size_t i) { return is_in(i, inside) && !has(i, kDoubtful); };
  for (std::size_t row = 0; row < flags_.size(); row += width) {
    row_start.push_back(result.runs.size());
    for (std::size_t i = row; i < row + width; ++i) {
      if (!wanted(i)) continue;
      const std::size_t first = i;
      while (i + 1 < row + width && wanted(i + 1)) ++i;
      result.runs.push_back({first, i});
    }
  }
  row_start.push_back(result.runs.size());
  result.root.resize(result.runs.size());
  std::iota(result.root.begin(), result.root.end(), 0U);
  const auto find = [&](std::uint32_t r) {
    while (result.root[r] != r) r = result.root[r] = result.root[result.root[r]];
    return r;
  };
  const auto join_rows = [&](std::size_t row, std::size_t other) {  // `other` comes before `row`
    const std::size_t shift = (row - other) * width;
    std::size_t b = row_start[other];
    for (std::size_t a = row_start[row]; a < row_start[row + 1]; ++a) {
      while (b < row_start[other + 1] && result.runs[b].last + shift < result.runs[a].first) ++b;
      for (std::size_t c = b; c < row_start[other + 1] && result.runs[c].first + shift <= result.runs[a].last; ++c) {
        const std::uint32_t x = find(static_cast<std::uint32_t>(a)), y = find(static_cast<std::uint32_t>(c));
        result.root[std::max(x, y)] = std::min(x, y);
      }
    }
  };
  const auto height = static_cast<std::size_t>(size_.y());
  for (std::size_t row = 0; row + 1 < row_start.size(); ++row) {
    if (row % height != 0) join_rows(row, row - 1);
    if (row >= height) join_rows(row, row - height);
  }
  for (std::uint32_t r = 0; r < result.root.size(); ++r) result.root[r] = find(r);
  return result;
}

std::vector<std::size_t> VoxelLabels::grow(bool inside) {
  const Neighbourhood& n = neighbourhood();
  std::array<std::ptrdiff_t, 26> steps;
  for (std::size_t k = 0; k < 26; ++k) steps[k] = step(n.offset[k].x(), n.offset[k].y(), n.offset[k].z());
  std::vector<std::ptrdiff_t> touching;
  for (std::size_t k = 0; k < 26; ++k) {
    if (((inside ? n.around18 : n.around6) >> k & 1U) != 0) touching.push_back(steps[k]);
  }
  for (auto& flags : flags_) flags &= static_cast<std::uint8_t>(~(kGrown | kQueued));

  const Runs certain = certain_runs(inside);
  std::vector<std::size_t> voxels(certain.runs.size());
  for (std::size_t r = 0; r < voxels.size(); ++r) {
    voxels[certain.root[r]] += certain.runs[r].last - certain.runs[r].first + 1;
  }
  if (voxels.empty()) return {};

  std::vector<std::size_t> queue;
  const auto queue_around = [&](std::size_t i) {
    if (on_rim(i)) return;
    for (const auto to : touching) {
      const std::size_t j = i + to;
      if (!is_in(j, inside) || has(j, kGrown) || has(j, kQueued) || on_rim(j)) continue;
      flags_[j] |= kQueued;
      queue.push_back(j);
    }
  };
  const auto add_component = [&](std::uint32_t root) {
    for (std::size_t r = root; r < certain.runs.size(); ++r) {
      if (certain.root[r] != root) continue;
      for (std::size_t i = certain.runs[r].first; i <= certain.runs[r].last; ++i) flags_[i] |= kGrown;
    }
    for (std::size_t r = root; r < certain.runs.size(); ++r) {
      if (certain.root[r] != root) continue;
      for (std::size_t i = certain.runs[r].first; i <= certain.runs[r].last; ++i) queue_around(i);
    }
  };
  add_component(static_cast<std::uint32_t>(std::max_element(voxels.begin(), voxels.end()) - voxels.begin()));

  std::vector<std::size_t> blocked;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::size_t i = queue[next];
    flags_[i] &= static_cast<std::uint8_t>(~kQueued);
    if (has(i, kGrown)) continue;
    if (!has(i, kDoubtful)) {  // the first contact with another certain component takes all of it
      const auto run = std::upper_bound(certain.runs.begin(), certain.runs.end(), i,
                                        [](std::size_t index, const Run& r) { return index < r.first; });
      add_component(certain.root[static_cast<std::size_t>(run - certain.runs.begin()) - 1]);
      continue;
    }
    std::uint32_t grown = 0;
    for (std::size_t k = 0; k < 26; ++k) grown |= has(i + steps[k], kGrown) ? 1U << k : 0U;
    if (components_around(grown, inside) != 1) {
      blocked.push_back(i);  // looked at again when a neighbour is added
      continue;
    }
    flags_[i] |= kGrown;
    queue_around(i);
  }
  std::sort(blocked.begin(), blocked.end());
  blocked.erase(std::unique(blocked.begin(), blocked.end()), blocked.end());
  std::erase_if(blocked, [&](std::size_t i) { return has(i, kGrown); });
  return blocked;
}

}  // namespace scanrig
