#include "pipeline/volume/voxel_bytes.h"

#include <algorithm>
#include <bit>

#include "core/parallel_blocks.h"

namespace scanrig {
namespace {

int bits_for(int blocks) { return std::bit_width(static_cast<unsigned>(kBlockSide * blocks - 1)); }

}  // namespace

VoxelBytes::VoxelBytes(const Eigen::Vector3i& blocks)
    : blocks_(blocks),
      x_bits_(bits_for(blocks.x())),
      y_bits_(bits_for(blocks.y())),
      values_(static_cast<std::size_t>(blocks.x()) * blocks.y() * blocks.z(), 0) {
  pages_.resize(values_.size());
}

std::uint8_t& VoxelBytes::writable(std::size_t i) {
  const std::size_t block = block_of(i);
  if (!pages_[block]) {
    pages_[block] = std::make_unique<Page>();
    pages_[block]->fill(values_[block]);
  }
  return (*pages_[block])[place_of(i)];
}

void VoxelBytes::fill_block(std::size_t block, std::uint8_t value) {
  pages_[block].reset();
  values_[block] = value;
}

void VoxelBytes::clear_bits_everywhere(std::uint8_t bits) {
  const auto kept = static_cast<std::uint8_t>(~bits);
  for_each_in_blocks(pages_.size(), [&](std::size_t block) {
    values_[block] &= kept;
    if (!pages_[block]) return;
    for (auto& value : *pages_[block]) value &= kept;
  });
  release_pages();
}

void VoxelBytes::release_pages() {
  for_each_in_blocks(pages_.size(), [&](std::size_t block) {
    if (!pages_[block]) return;
    const std::uint8_t first = pages_[block]->front();
    if (std::ranges::all_of(*pages_[block], [&](std::uint8_t value) { return value == first; })) {
      fill_block(block, first);
    }
  });
}

std::size_t VoxelBytes::page_count() const {
  return static_cast<std::size_t>(std::ranges::count_if(pages_, [](const auto& page) { return page != nullptr; }));
}

}  // namespace scanrig
