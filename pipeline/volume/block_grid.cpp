#include "pipeline/volume/block_grid.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr std::size_t kMaxBlocks = 400'000;  // about 1 GB of nodes
constexpr double kMaxBlocksInBox = 3e7;
const std::array<Eigen::Vector3i, 6> kFaces = {
    Eigen::Vector3i{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

}  // namespace

BlockGrid::BlockGrid(const Eigen::AlignedBox3f& box, float voxel_mm) : voxel_(voxel_mm) {
  const float block_mm = voxel_mm * kBlockSide;
  // The lattice goes through the model's origin: the same voxels whatever the box.
  const Eigen::Vector3f low = (box.min() / block_mm).array().floor() - 1.0F;
  const Eigen::Vector3f high = (box.max() / block_mm).array().floor() + 2.0F;
  origin_ = low * block_mm;
  size_ = (high - low).cast<int>();
}

const BlockGrid::Block* BlockGrid::find(const Eigen::Vector3i& block) const {
  if (!contains(block)) return nullptr;
  const std::int32_t slot = slot_[linear(block)];
  return slot >= 0 ? &blocks_[static_cast<std::size_t>(slot)] : nullptr;
}

bool BlockGrid::all_inside(const Eigen::Vector3i& block) const {
  return contains(block) && slot_[linear(block)] == kInside;
}

/// The sign of each block's first node represents the block until it is stored.
void BlockGrid::classify_blocks(const Field& field) {
  slot_.assign(static_cast<std::size_t>(size_.prod()), kOutside);
  const Field::Neighbourhood everywhere = field.everywhere();
  parallel_for(static_cast<std::size_t>(size_.z()), [&](std::size_t z) {
    Eigen::Vector3i b(0, 0, static_cast<int>(z));
    for (b.y() = 0; b.y() < size_.y(); ++b.y()) {
      for (b.x() = 0; b.x() < size_.x(); ++b.x()) {
        if (field.is_inside(position(kBlockSide * b), everywhere)) slot_[linear(b)] = kInside;
      }
    }
  });
}

std::vector<Eigen::Vector3i> BlockGrid::seed_blocks(const std::vector<Eigen::Vector3f>& seeds) const {
  std::vector<bool> is_seed(slot_.size());
  for (const auto& point : seeds) {
    const Eigen::Vector3i b = ((point - origin_) / (voxel_ * kBlockSide)).array().floor().cast<int>();
    if (contains(b)) is_seed[linear(b)] = true;
  }
  std::vector<Eigen::Vector3i> result;
  Eigen::Vector3i b;
  for (b.z() = 0; b.z() < size_.z(); ++b.z()) {
    for (b.y() = 0; b.y() < size_.y(); ++b.y()) {
      for (b.x() = 0; b.x() < size_.x(); ++b.x()) {
        const std::size_t i = linear(b);
        const bool changes = std::any_of(kFaces.begin(), kFaces.end(), [&](const Eigen::Vector3i& face) {
          return contains(b + face) && slot_[linear(b + face)] != slot_[i];
        });
        if (is_seed[i] || changes) result.push_back(b);
      }
    }
  }
  return result;
}

void BlockGrid::evaluate(const Field& field, Block& block) const {
  const Eigen::Vector3i first = kBlockSide * block.index;
  const Eigen::Vector3f half = Eigen::Vector3f::Constant(0.5F * voxel_ * (kBlockSide - 1));
  const Field::Neighbourhood neighbourhood = field.near(position(first) + half, half.norm());
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      for (int x = 0; x < kBlockSide; ++x) {
        const FieldValue value = field.at(position(first + Eigen::Vector3i(x, y, z)), neighbourhood);
        block.distance[Block::node(x, y, z)] = value.distance;
        block.support[Block::node(x, y, z)] = value.support;
      }
    }
  }
}

/// Neighbours that are not stored although the surface passes between them and this block.
std::vector<Eigen::Vector3i> BlockGrid::open_neighbours(const Block& block) const {
  std::vector<Eigen::Vector3i> result;
  for (const auto& face : kFaces) {
    const Eigen::Vector3i other = block.index + face;
    if (!contains(other) || slot_[linear(other)] >= 0) continue;
    const bool inside = slot_[linear(other)] == kInside;
    const int axis = face.x() != 0 ? 0 : face.y() != 0 ? 1 : 2;
    Eigen::Vector3i n;
    n[axis] = face[axis] > 0 ? kBlockSide - 1 : 0;
    bool open = false;
    for (int i = 0; i < kBlockSide && !open; ++i) {
      for (int j = 0; j < kBlockSide && !open; ++j) {
        n[(axis + 1) % 3] = i;
        n[(axis + 2) % 3] = j;
        open = (block.distance[Block::node(n.x(), n.y(), n.z())] < 0.0F) != inside;
      }
    }
    if (open) result.push_back(other);
  }
  return result;
}

Result<void> BlockGrid::fill(const Field& field, const std::vector<Eigen::Vector3f>& seeds, const Context& context) {
  if (size_.cast<double>().prod() > kMaxBlocksInBox) {
    return fail(ErrorCode::out_of_range, "volume: {} x {} x {} blocks of 8 voxels exceed the limit; use larger voxels",
                size_.x(), size_.y(), size_.z());
  }
  classify_blocks(field);
  if (context.stopped()) return fail(ErrorCode::stopped, "volume: stopped");
  std::vector<Eigen::Vector3i> wanted = seed_blocks(seeds);
  while (!wanted.empty()) {
    const std::size_t first = blocks_.size();
    if (first + wanted.size() > kMaxBlocks) {
      return fail(ErrorCode::out_of_range,
                  "volume: the surface needs more than {} blocks of 8 voxels; use larger voxels", kMaxBlocks);
    }
    blocks_.resize(first + wanted.size());
    parallel_for(wanted.size(), [&](std::size_t i) {
      blocks_[first + i].index = wanted[i];
      if (!context.stopped()) evaluate(field, blocks_[first + i]);
    });
    if (context.stopped()) return fail(ErrorCode::stopped, "volume: stopped");
    for (std::size_t i = 0; i < wanted.size(); ++i) slot_[linear(wanted[i])] = static_cast<std::int32_t>(first + i);
    wanted.clear();
    std::vector<bool> is_wanted(slot_.size());
    for (const auto& block : blocks_) {
      for (const auto& other : open_neighbours(block)) {
        if (!is_wanted[linear(other)]) wanted.push_back(other);
        is_wanted[linear(other)] = true;
      }
    }
  }
  std::sort(blocks_.begin(), blocks_.end(),
            [&](const Block& a, const Block& b) { return linear(a.index) < linear(b.index); });
  for (std::size_t i = 0; i < blocks_.size(); ++i) slot_[linear(blocks_[i].index)] = static_cast<std::int32_t>(i);
  return {};
}

BlockGrid::Block& BlockGrid::store(const Eigen::Vector3i& block, float band_mm) {
  std::int32_t& slot = slot_[linear(block)];
  if (slot < 0) {
    Block& fresh = blocks_.emplace_back();
    fresh.index = block;
    fresh.distance.fill(slot == kInside ? -band_mm : band_mm);
    fresh.support.fill(Support::bounds);
    slot = static_cast<std::int32_t>(blocks_.size() - 1);
  }
  return blocks_[static_cast<std::size_t>(slot)];
}

void BlockGrid::set(const Eigen::Vector3i& node, float distance, float band_mm) {
  const auto block_of = [](const Eigen::Vector3i& n) {
    return n.unaryExpr([](int c) { return c / kBlockSide; }).eval();
  };
  for (const auto& face : kFaces) {
    const Eigen::Vector3i other = block_of(node + face);
    if (contains(other)) store(other, band_mm);
  }
  const Eigen::Vector3i local = node - kBlockSide * block_of(node);
  store(block_of(node), band_mm).distance[Block::node(local.x(), local.y(), local.z())] = distance;
}

}  // namespace scanrig
