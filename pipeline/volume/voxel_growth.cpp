#include <algorithm>
#include <array>
#include <bit>
#include <unordered_set>
#include <utility>

#include "pipeline/volume/voxel_labels.h"
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

}  // namespace

/// The set while it grows, voxel by voxel, from its largest certain component.
class VoxelLabels::Growth {
 public:
  Growth(VoxelLabels& labels, bool inside)
      : flags_(labels.flags_),
        inside_(inside),
        certain_(flags_, [&](auto flags) { return is_certain(flags, inside); }) {
    const Neighbourhood& n = neighbourhood();
    for (std::size_t k = 0; k < 26; ++k) {
      steps_[k] = flags_.step(n.offset[k].x(), n.offset[k].y(), n.offset[k].z());
      if ((touching_it(inside) >> k & 1U) != 0) touching_.push_back(steps_[k]);
    }
  }

  /// Voxels that would have closed a loop.
  std::vector<std::size_t> run() {
    if (certain_.empty()) return {};
    is_buried_ = buried_blocks();
    add_component(certain_.largest());
    std::vector<std::size_t> blocked;
    for (std::size_t next = 0; next < queue_.size(); ++next) {
      const std::size_t i = queue_[next];
      flags_.clear_bits(i, kQueued);
      if (has(i, kGrown)) continue;
      if (!has(i, kDoubtful)) {  // the first contact with another certain component takes all of it
        add_component(certain_.component_of(i));
        continue;
      }
      std::uint32_t grown = 0;
      for (std::size_t k = 0; k < 26; ++k) grown |= has(i + steps_[k], kGrown) ? 1U << k : 0U;
      if (components_around(grown, inside_) != 1) {
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

 private:
  [[nodiscard]] bool has(std::size_t i, Flag flag) const { return (flags_.at(i) & flag) != 0; }
  [[nodiscard]] std::vector<bool> buried_blocks() const;

  void queue_around(std::size_t i) {
    if (has(i, kRim)) return;
    for (const auto to : touching_) {
      const std::size_t j = i + to;
      const std::uint8_t flags = flags_.at(j);
      if (((flags & kInside) != 0) != inside_ || (flags & (kGrown | kQueued | kRim)) != 0) continue;
      flags_.set_bits(j, kQueued);
      queue_.push_back(j);
    }
  }

  void add_component(std::uint32_t component) {
    certain_.for_each_part(component, [&](std::size_t first, std::size_t last) {
      const std::size_t block = flags_.block_of(first);
      if (const auto common = flags_.common(block)) {  // all of it is of this component
        flags_.fill_block(block, *common | kGrown);
        return;
      }
      for (std::size_t i = first; i <= last; ++i) flags_.set_bits(i, kGrown);
    });
    certain_.for_each_part(component, [&](std::size_t first, std::size_t last) {
      const std::size_t block = flags_.block_of(first);
      if (is_buried_[block]) return;
      // Inside a block of one value a row has neighbours elsewhere at its ends only.
      const bool is_enclosed = flags_.common(block) && !is_at_side(flags_.voxel(first));
      const std::size_t stride = is_enclosed ? std::max<std::size_t>(last - first, 1) : 1;
      for (std::size_t i = first; i <= last; i += stride) queue_around(i);
    });
  }

  VoxelBytes& flags_;
  bool inside_;
  VoxelRuns certain_;
  std::array<std::ptrdiff_t, 26> steps_;  ///< to the neighbours
  std::vector<std::ptrdiff_t> touching_;  ///< to those that touch
  std::vector<bool> is_buried_;
  std::vector<std::size_t> queue_;
};

/// Blocks of certain voxels, all of the set, amid 26 such blocks: nothing of it that touches them is elsewhere.
std::vector<bool> VoxelLabels::Growth::buried_blocks() const {
  const Eigen::Vector3i size = flags_.blocks();
  const auto is_whole = [&](const Eigen::Vector3i& b) {
    const auto common = flags_.common(flags_.block_at(b));
    return common && is_certain(*common, inside_);
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
  flags_.clear_bits_everywhere(kGrown | kQueued);
  return Growth(*this, inside).run();
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
