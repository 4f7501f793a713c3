#include "pipeline/volume/voxel_labels.h"

#include <algorithm>
#include <bit>
#include <unordered_set>
#include <utility>

#include "core/parallel.h"
#include "pipeline/volume/voxel_runs.h"

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

/// Does a row of a block, along x, lie in one of its sides?
bool is_at_side(const Eigen::Vector3i& voxel) {
  const int y = voxel.y() % kBlockSide, z = voxel.z() % kBlockSide;
  return y == 0 || z == 0 || y == kBlockSide - 1 || z == kBlockSide - 1;
}

/// The stored blocks and one more on each side.
struct BlockRange {
  Eigen::Vector3i low, size;

  explicit BlockRange(const BlockGrid& grid) : low(grid.size()), size(Eigen::Vector3i::Zero()) {
    Eigen::Vector3i high = Eigen::Vector3i::Zero();
    for (const auto& block : grid.blocks()) {
      low = low.cwiseMin(block.index);
      high = high.cwiseMax(block.index);
    }
    low.array() -= 1;
    size = (high - low).array() + 2;
  }
};

}  // namespace

VoxelLabels::VoxelLabels(const BlockGrid& grid)
    : first_(kBlockSide * BlockRange(grid).low), flags_(BlockRange(grid).size) {
  const Eigen::Vector3i low = first_ / kBlockSide, size = flags_.blocks();
  parallel_for(static_cast<std::size_t>(size.z()), [&](std::size_t layer) {
    Eigen::Vector3i b(0, 0, static_cast<int>(layer));
    for (b.y() = 0; b.y() < size.y(); ++b.y()) {
      for (b.x() = 0; b.x() < size.x(); ++b.x()) {
        const bool is_rim = (b.array() == 0).any() || (b.array() == size.array() - 1).any();
        flags_.fill_block(flags_.block_at(b), Flag{is_rim ? kRim : grid.all_inside(low + b) ? kInside : Flag{}});
        const auto* block = grid.find(low + b);
        for (int n = 0; block != nullptr && n < BlockGrid::kNodes; ++n) {
          const Eigen::Vector3i in_block(n % kBlockSide, n / kBlockSide % kBlockSide, n / (kBlockSide * kBlockSide));
          if (block->distance[n] < 0.0F) flags_.set_bits(flags_.index(kBlockSide * b + in_block), kInside);
        }
      }
    }
  });
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
      body(flags_.index(p), block, n);
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
  flags_.clear_bits_everywhere(kDoubtful);
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
  for (const auto i : certain) flags_.set_bits(i, kReached);
  for (const auto i : doubtful) flags_.set_bits(i, kReached | kDoubtful);
  const int depth = static_cast<int>(reach_mm / grid.voxel());
  for (int layer = 0; layer < depth && !doubtful.empty(); ++layer) {
    for (auto* front : {&certain, &doubtful}) *front = next_layer(*front);
    if (layer % kBlockSide == 0) flags_.release_pages();
  }
  flags_.clear_bits_everywhere(kReached);
}

/// The opening of solid and space [Serra 1982]: what a core, `layers` below the surface, reaches in as many steps.
void VoxelLabels::doubt_thin(const BlockGrid& grid, int layers) {
  const auto faces = this->faces();
  flags_.clear_bits_everywhere(kDoubtful);
  std::vector<std::size_t> front, shallow;
  for_each_stored(grid, [&](std::size_t i, const BlockGrid::Block&, int) {
    const bool surface = std::any_of(faces.begin(), faces.end(),
                                     [&](std::ptrdiff_t face) { return has(i + face, kInside) != has(i, kInside); });
    if (surface) front.push_back(i);
  });
  for (const auto i : front) flags_.set_bits(i, kReached);
  for (int layer = 0; layer < layers; ++layer) {
    shallow.insert(shallow.end(), front.begin(), front.end());
    front = next_layer(front);
  }
  for (const auto i : front) flags_.set_bits(i, kThick);
  for (int layer = 0; layer < layers; ++layer) {
    std::vector<std::size_t> next;
    for (const auto i : front) {
      for (const auto face : faces) {
        const std::size_t j = i + face;
        if (!has(j, kReached) || has(j, kThick) || has(j, kInside) != has(i, kInside)) continue;
        flags_.set_bits(j, kThick);
        next.push_back(j);
      }
    }
    front = std::move(next);
  }
  for (const auto i : shallow) {
    if (!has(i, kThick)) flags_.set_bits(i, kDoubtful);
  }
  for_each_stored(grid, [&](std::size_t i, const BlockGrid::Block& block, int n) {
    if (!has(i, kInside) && block.support[n] == Support::free) flags_.clear_bits(i, kDoubtful);
  });
  flags_.clear_bits_everywhere(kReached | kThick);
}

/// Neighbours of `front` through faces, of its own kind, that were not reached; they are as doubtful as it is. The rim
/// is never reached.
std::vector<std::size_t> VoxelLabels::next_layer(const std::vector<std::size_t>& front) {
  std::vector<std::size_t> next;
  for (const auto i : front) {
    const bool is_inside = has(i, kInside);
    const auto mark = static_cast<std::uint8_t>(kReached | (flags_.at(i) & kDoubtful));
    for (const auto face : faces()) {
      const std::size_t j = i + face;
      if (has(j, kReached) || has(j, kInside) != is_inside || on_rim(j)) continue;
      flags_.set_bits(j, mark);
      next.push_back(j);
    }
  }
  return next;
}

/// Blocks of certain voxels, all of the set, amid 26 such blocks: nothing of it that touches them is elsewhere.
std::vector<bool> VoxelLabels::buried_blocks(bool inside) const {
  const Eigen::Vector3i size = flags_.blocks();
  const auto is_whole = [&](const Eigen::Vector3i& b) {
    const auto common = flags_.common(flags_.block_at(b));
    return common && is_certain(*common, inside);
  };
  std::vector<bool> result(flags_.block_count());
  Eigen::Vector3i b;
  for (b.z() = 1; b.z() < size.z() - 1; ++b.z()) {
    for (b.y() = 1; b.y() < size.y() - 1; ++b.y()) {
      for (b.x() = 1; b.x() < size.x() - 1; ++b.x()) {
        const auto& around = neighbourhood().offset;
        result[flags_.block_at(b)] =
            is_whole(b) && std::ranges::all_of(around, [&](const Eigen::Vector3i& to) { return is_whole(b + to); });
      }
    }
  }
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
  flags_.clear_bits_everywhere(kGrown | kQueued);

  const VoxelRuns certain(flags_, [&](std::uint8_t flags) { return is_certain(flags, inside); });
  if (certain.empty()) return {};
  const std::vector<bool> is_buried = buried_blocks(inside);

  std::vector<std::size_t> queue;
  const auto queue_around = [&](std::size_t i) {
    if (on_rim(i)) return;
    for (const auto to : touching) {
      const std::size_t j = i + to;
      const std::uint8_t flags = flags_.at(j);
      if (((flags & kInside) != 0) != inside || (flags & (kGrown | kQueued | kRim)) != 0) continue;
      flags_.set_bits(j, kQueued);
      queue.push_back(j);
    }
  };
  const auto add_component = [&](std::uint32_t component) {
    certain.for_each_part(component, [&](std::size_t first, std::size_t last) {
      const std::size_t block = flags_.block_of(first);
      if (const auto common = flags_.common(block)) {  // all of it is of this component
        flags_.fill_block(block, *common | kGrown);
        return;
      }
      for (std::size_t i = first; i <= last; ++i) flags_.set_bits(i, kGrown);
    });
    certain.for_each_part(component, [&](std::size_t first, std::size_t last) {
      const std::size_t block = flags_.block_of(first);
      if (is_buried[block]) return;
      // Inside a block of one value a row has neighbours elsewhere at its ends only.
      const bool is_enclosed = flags_.common(block) && !is_at_side(flags_.voxel(first));
      const std::size_t stride = is_enclosed ? std::max<std::size_t>(last - first, 1) : 1;
      for (std::size_t i = first; i <= last; i += stride) queue_around(i);
    });
  };
  add_component(certain.largest());

  std::vector<std::size_t> blocked;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::size_t i = queue[next];
    flags_.clear_bits(i, kQueued);
    if (has(i, kGrown)) continue;
    if (!has(i, kDoubtful)) {  // the first contact with another certain component takes all of it
      add_component(certain.component_of(i));
      continue;
    }
    std::uint32_t grown = 0;
    for (std::size_t k = 0; k < 26; ++k) grown |= has(i + steps[k], kGrown) ? 1U << k : 0U;
    if (components_around(grown, inside) != 1) {
      blocked.push_back(i);  // looked at again when a neighbour is added
      continue;
    }
    flags_.set_bits(i, kGrown);
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
