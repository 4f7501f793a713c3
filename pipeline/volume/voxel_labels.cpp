#include "pipeline/volume/voxel_labels.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <unordered_set>
#include <utility>

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

std::uint32_t touching_it(bool inside) { return inside ? neighbourhood().around18 : neighbourhood().around6; }

/// Of `members` among the 26 neighbours: those joined with `first`, a single one.
std::uint32_t component_of(std::uint32_t first, std::uint32_t members, bool inside) {
  const Neighbourhood& n = neighbourhood();
  const auto& touching = inside ? n.touching18 : n.touching6;
  std::uint32_t component = first, front = first;
  while (front != 0) {
    const auto voxel = static_cast<std::size_t>(std::countr_zero(front));
    front &= front - 1;
    const std::uint32_t fresh = touching[voxel] & members & ~component;
    component |= fresh;
    front |= fresh;
  }
  return component;
}

/// Components of `members` among the 26 neighbours that touch the voxel in the middle.
int components_around(std::uint32_t members, bool inside) {
  std::uint32_t left = members & touching_it(inside);
  int count = 0;
  for (; left != 0; ++count) left &= ~component_of(left & -left, members, inside);
  return count;
}

}  // namespace

VoxelLabels::VoxelLabels(const BlockGrid& grid) {
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

std::array<std::ptrdiff_t, 6> VoxelLabels::faces() const {
  return {step(1, 0, 0), step(-1, 0, 0), step(0, 1, 0), step(0, -1, 0), step(0, 0, 1), step(0, 0, -1)};
}

template <class Body>
void VoxelLabels::for_each_stored(const BlockGrid& grid, const Body& body) const {
  for (const auto& block : grid.blocks()) {
    for (int n = 0; n < BlockGrid::kNodes; ++n) {
      const Eigen::Vector3i p =
          kBlockSide * block.index - first_ +
          Eigen::Vector3i(n % kBlockSide, n / kBlockSide % kBlockSide, n / (kBlockSide * kBlockSide));
      body(static_cast<std::size_t>(step(p.x(), p.y(), p.z())), block, n);
    }
  }
}

void VoxelLabels::doubt_unmeasured(const BlockGrid& grid, float reach_mm) {
  const auto faces = this->faces();
  const auto is_measured = [&](std::size_t i) {
    const Eigen::Vector3i n = node(i);
    const auto* block = grid.find(n.unaryExpr([](int c) { return c / kBlockSide; }));
    const Eigen::Vector3i local = n.unaryExpr([](int c) { return c % kBlockSide; });
    return block != nullptr &&
           block->support[BlockGrid::Block::node(local.x(), local.y(), local.z())] == Support::measured;
  };
  std::vector<std::size_t> certain, doubtful;
  for_each_stored(grid, [&](std::size_t i, const BlockGrid::Block& block, int n) {
    bool surface = false, measured = false;  // both ends of a cut edge must be
    for (const auto face : faces) {
      if (has(i + face, kInside) == has(i, kInside)) continue;
      surface = true;
      measured = measured || (block.support[n] == Support::measured && is_measured(i + face));
    }
    // What views looked through is open, however narrow: no repair may fill it.
    const bool is_open = !has(i, kInside) && block.support[n] == Support::free;
    if (surface || is_open) (measured || is_open ? certain : doubtful).push_back(i);
  });
  std::vector<std::uint8_t> reached(flags_.size());
  for (const auto i : certain) reached[i] = 1;
  for (const auto i : doubtful) reached[i] = 2;
  const int depth = static_cast<int>(reach_mm / grid.voxel());
  for (int layer = 0; layer < depth && !doubtful.empty(); ++layer) {
    for (auto* front : {&certain, &doubtful}) *front = next_layer(*front, reached);
  }
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    flags_[i] &= static_cast<std::uint8_t>(~kDoubtful);
    if (reached[i] == 2 && !on_rim(i)) flags_[i] |= kDoubtful;
  }
}

/// The opening of solid and space [Serra 1982]: what a core, `layers` below the surface, reaches in as many steps.
void VoxelLabels::doubt_thin(const BlockGrid& grid, int layers) {
  constexpr std::uint8_t kShallow = 1, kThick = 2;
  const auto faces = this->faces();
  for (auto& flags : flags_) flags &= static_cast<std::uint8_t>(~kDoubtful);
  std::vector<std::uint8_t> reached(flags_.size());
  std::vector<std::size_t> front, shallow;
  for_each_stored(grid, [&](std::size_t i, const BlockGrid::Block&, int) {
    const bool surface = std::any_of(faces.begin(), faces.end(),
                                     [&](std::ptrdiff_t face) { return has(i + face, kInside) != has(i, kInside); });
    if (surface) front.push_back(i);
  });
  for (const auto i : front) reached[i] = kShallow;
  for (int layer = 0; layer < layers; ++layer) {
    shallow.insert(shallow.end(), front.begin(), front.end());
    front = next_layer(front, reached);
  }
  for (const auto i : front) reached[i] = kThick;
  for (int layer = 0; layer < layers; ++layer) {
    std::vector<std::size_t> next;
    for (const auto i : front) {
      if (on_rim(i)) continue;
      for (const auto face : faces) {
        const std::size_t j = i + face;
        if (reached[j] != kShallow || has(j, kInside) != has(i, kInside)) continue;
        reached[j] = kThick;
        next.push_back(j);
      }
    }
    front = std::move(next);
  }
  for (const auto i : shallow) {
    if (reached[i] == kShallow && !on_rim(i)) flags_[i] |= kDoubtful;
  }
  for_each_stored(grid, [&](std::size_t i, const BlockGrid::Block& block, int n) {
    if (!has(i, kInside) && block.support[n] == Support::free) flags_[i] &= static_cast<std::uint8_t>(~kDoubtful);
  });
}

/// Neighbours of `front` through faces, of its own kind, that were not reached; they take its mark.
std::vector<std::size_t> VoxelLabels::next_layer(const std::vector<std::size_t>& front,
                                                 std::vector<std::uint8_t>& reached) const {
  std::vector<std::size_t> next;
  for (const auto i : front) {
    if (on_rim(i)) continue;
    for (const auto face : faces()) {
      const std::size_t j = i + face;
      if (reached[j] != 0 || has(j, kInside) != has(i, kInside)) continue;
      reached[j] = reached[i];
      next.push_back(j);
    }
  }
  return next;
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
    if ((touching_it(inside) >> k & 1U) != 0) touching.push_back(steps[k]);
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

bool VoxelLabels::closes_short_loop(std::size_t blocked, bool inside, int longest) const {
  const Neighbourhood& n = neighbourhood();
  const auto at = [&](std::size_t k) { return blocked + step(n.offset[k].x(), n.offset[k].y(), n.offset[k].z()); };
  std::uint32_t grown = 0;
  for (std::size_t k = 0; k < 26; ++k) grown |= has(at(k), kGrown) ? 1U << k : 0U;
  const std::uint32_t ends = grown & touching_it(inside), start = component_of(ends & -ends, grown, inside);
  std::vector<std::size_t> front, goals;
  for (std::size_t k = 0; k < 26; ++k) {
    if ((ends >> k & 1U) != 0) ((start >> k & 1U) != 0 ? front : goals).push_back(at(k));
  }
  std::unordered_set<std::size_t> seen(front.begin(), front.end());
  for (int length = 2; length < longest && !front.empty(); ++length) {  // of the loop that ends in `front`
    std::vector<std::size_t> next;
    for (const std::size_t i : front) {
      if (std::find(goals.begin(), goals.end(), i) != goals.end()) return true;
      if (on_rim(i)) continue;
      for (std::size_t k = 0; k < 26; ++k) {
        const std::size_t j = i + step(n.offset[k].x(), n.offset[k].y(), n.offset[k].z());
        if ((touching_it(inside) >> k & 1U) != 0 && has(j, kGrown) && seen.insert(j).second) next.push_back(j);
      }
    }
    front = std::move(next);
  }
  return false;
}

}  // namespace scanrig
