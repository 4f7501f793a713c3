#include "pipeline/volume/voxel_labels.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"

namespace scanrig {
namespace {

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

}  // namespace scanrig
