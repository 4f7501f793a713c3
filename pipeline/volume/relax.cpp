#include "pipeline/volume/relax.h"

#include <algorithm>
#include <array>
#include <deque>
#include <vector>

#include "core/parallel.h"

namespace scanrig {
namespace {

using Block = BlockGrid::Block;
constexpr int kPadded = kBlockSide + 2;

/// A block's distances with one layer of its six neighbours around.
struct Padded {
  std::array<float, kPadded * kPadded * kPadded> distance;
  std::array<bool, 6> open;  ///< the neighbour is stored

  static int at(int x, int y, int z) { return ((z + 1) * kPadded + y + 1) * kPadded + x + 1; }

  Padded(const BlockGrid& grid, const Block& block, float band) {
    for (int z = 0; z < kBlockSide; ++z) {
      for (int y = 0; y < kBlockSide; ++y) {
        for (int x = 0; x < kBlockSide; ++x) distance[at(x, y, z)] = block.distance[Block::node(x, y, z)];
      }
    }
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2, side = face % 2;
      const Eigen::Vector3i index = block.index + (side == 0 ? -1 : 1) * Eigen::Vector3i::Unit(axis);
      const Block* other = grid.find(index);
      open[face] = other != nullptr;
      const float constant = grid.all_inside(index) ? -band : band;
      Eigen::Vector3i here, there;
      here[axis] = side == 0 ? -1 : kBlockSide;
      there[axis] = side == 0 ? kBlockSide - 1 : 0;
      for (int i = 0; i < kBlockSide; ++i) {
        for (int j = 0; j < kBlockSide; ++j) {
          here[(axis + 1) % 3] = there[(axis + 1) % 3] = i;
          here[(axis + 2) % 3] = there[(axis + 2) % 3] = j;
          distance[at(here.x(), here.y(), here.z())] =
              other == nullptr ? constant : other->distance[Block::node(there.x(), there.y(), there.z())];
        }
      }
    }
  }

  /// A node beside a missing block keeps its sign: the surface may not leave the stored blocks.
  [[nodiscard]] bool touches_unstored(int x, int y, int z) const {
    return (x == 0 && !open[0]) || (x == kBlockSide - 1 && !open[1]) || (y == 0 && !open[2]) ||
           (y == kBlockSide - 1 && !open[3]) || (z == 0 && !open[4]) || (z == kBlockSide - 1 && !open[5]);
  }
};

std::array<float, BlockGrid::kNodes> relaxed(const BlockGrid& grid, const Block& block, float band) {
  const Padded padded(grid, block, band);
  std::array<float, BlockGrid::kNodes> result = block.distance;
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      for (int x = 0; x < kBlockSide; ++x) {
        const int node = Block::node(x, y, z);
        if (block.support[node] == Support::measured || padded.touches_unstored(x, y, z)) continue;
        const auto& d = padded.distance;
        const int i = Padded::at(x, y, z);
        constexpr int kRow = kPadded, kLayer = kPadded * kPadded;
        result[node] = (d[i] + d[i - 1] + d[i + 1] + d[i - kRow] + d[i + kRow] + d[i - kLayer] + d[i + kLayer]) / 7.0F;
      }
    }
  }
  return result;
}

bool has_unmeasured(const Block& block) {
  return std::ranges::any_of(block.support, [](Support support) { return support != Support::measured; });
}

}  // namespace

void relax_unmeasured(BlockGrid& grid, float band_mm, int rounds) {
  std::deque<Block>& blocks = grid.blocks();
  std::vector<std::size_t> changing;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (has_unmeasured(blocks[i])) changing.push_back(i);
  }
  std::vector<std::array<float, BlockGrid::kNodes>> next(changing.size());
  for (int round = 0; round < rounds; ++round) {
    parallel_for(changing.size(), [&](std::size_t i) { next[i] = relaxed(grid, blocks[changing[i]], band_mm); });
    parallel_for(changing.size(), [&](std::size_t i) { blocks[changing[i]].distance = next[i]; });
  }
}

}  // namespace scanrig
