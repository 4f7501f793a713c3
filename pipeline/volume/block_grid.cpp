#include "pipeline/volume/block_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace scanrig {
namespace {

constexpr std::size_t kMaxBlocks = 1'600'000;  // about 4 GB of nodes
constexpr double kMaxBlocksInBox = 1e8;
const std::array<Eigen::Vector3i, 6> kFaces = {
    Eigen::Vector3i{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

/// Of a block's nodes along one axis.
bool is_coarse(int node) { return node % 2 == 0 || node == kBlockSide - 1; }

}  // namespace

BlockGrid::BlockGrid(const Eigen::AlignedBox3f& box, float voxel_mm) : voxel_(voxel_mm) {
  const float block_mm = voxel_mm * kBlockSide;
  // The lattice goes through the model's origin: the same voxels whatever the box.
  const Eigen::Vector3f low = (box.min() / block_mm).array().floor() - 1.0F;
  const Eigen::Vector3f high = (box.max() / block_mm).array().floor() + 2.0F;
  origin_ = low * block_mm;
  size_ = (high - low).cast<int>();
  slot_.assign(static_cast<std::size_t>(size_.x()) * size_.y() * size_.z(), kOutside);
}

const BlockGrid::Block* BlockGrid::find(const Eigen::Vector3i& block) const {
  if (!contains(block)) return nullptr;
  const std::int32_t slot = slot_[linear(block)];
  return slot >= 0 ? &blocks_[static_cast<std::size_t>(slot)] : nullptr;
}

bool BlockGrid::all_inside(const Eigen::Vector3i& block) const {
  return contains(block) && slot_[linear(block)] == kInside;
}

Eigen::Vector3i BlockGrid::block_at(std::size_t linear) const {
  const auto x = static_cast<std::size_t>(size_.x()), y = static_cast<std::size_t>(size_.y());
  return Eigen::Vector3i(static_cast<int>(linear % x), static_cast<int>(linear / x % y),
                         static_cast<int>(linear / x / y));
}

/// The sign of each block's first node represents the block until it is stored.
void BlockGrid::classify_blocks(Field& field) {
  std::vector<std::vector<std::size_t>> of_layer(static_cast<std::size_t>(size_.z()));
  const std::size_t layer = static_cast<std::size_t>(size_.x()) * size_.y();
  parallel_for(of_layer.size(), [&](std::size_t z) {
    for (std::size_t i = z * layer; i < (z + 1) * layer; ++i) {
      if (field.may_be_inside(position(kBlockSide * block_at(i)))) of_layer[z].push_back(i);
    }
  });
  std::vector<std::size_t> undecided;
  for (const auto& blocks : of_layer) undecided.insert(undecided.end(), blocks.begin(), blocks.end());
  const auto point_of = [&](std::size_t i) { return position(kBlockSide * block_at(undecided[i])); };
  const Field::Neighbourhood everywhere = field.everywhere();
  field.for_each_in_bricks(undecided.size(), point_of, [&](std::size_t i) {
    if (field.at(point_of(i), everywhere).distance < 0.0F) slot_[undecided[i]] = kInside;
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

/// Gives a node between evaluated ones the mean of their distances where they lie on one side of the surface, alike
/// supported and each farther from it than the node can be from them: no wall or thread passes between.
bool BlockGrid::interpolate_far_node(Block& block, const Eigen::Vector3i& node) const {
  const auto around = [](int n) { return is_coarse(n) ? std::array{n, n} : std::array{n - 1, n + 1}; };
  const auto x = around(node.x()), y = around(node.y()), z = around(node.z());
  const int corner = Block::node(x[0], y[0], z[0]);
  const float far = 2.0F * voxel_;
  float sum = 0.0F;
  for (int i = 0; i < 8; ++i) {
    const int n = Block::node(x[i & 1], y[i >> 1 & 1], z[i >> 2]);
    const float distance = block.distance[n];
    const bool is_alike = block.support[n] == block.support[corner] && std::abs(distance) > far &&
                          (distance > 0.0F) == (block.distance[corner] > 0.0F);
    if (!is_alike) return false;
    sum += distance;
  }
  block.distance[Block::node(node.x(), node.y(), node.z())] = sum / 8.0F;
  block.support[Block::node(node.x(), node.y(), node.z())] = block.support[corner];
  return true;
}

/// Every second node first, and the last ones. A node between them is evaluated only where the surface may be near.
void BlockGrid::evaluate(const Field& field, Block& block) const {
  const Eigen::Vector3i first = kBlockSide * block.index;
  const Eigen::Vector3f half = Eigen::Vector3f::Constant(0.5F * voxel_ * (kBlockSide - 1));
  const Field::Neighbourhood neighbourhood = field.near(position(first) + half, half.norm());
  const auto evaluate_node = [&](int x, int y, int z) {
    const FieldValue value = field.at(position(first + Eigen::Vector3i(x, y, z)), neighbourhood);
    block.distance[Block::node(x, y, z)] = value.distance;
    block.support[Block::node(x, y, z)] = value.support;
  };
  constexpr std::array<int, 5> kCoarse = {0, 2, 4, 6, kBlockSide - 1};
  for (const int z : kCoarse) {
    for (const int y : kCoarse) {
      for (const int x : kCoarse) evaluate_node(x, y, z);
    }
  }
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      for (int x = 0; x < kBlockSide; ++x) {
        if (is_coarse(x) && is_coarse(y) && is_coarse(z)) continue;
        if (!interpolate_far_node(block, {x, y, z})) evaluate_node(x, y, z);
      }
    }
  }
  const Eigen::Vector3f middle = position(first + Eigen::Vector3i::Constant(kBlockSide / 2));
  std::array<PoseDistance, kMaxPoses> pose;
  for (std::size_t p = 0; p < field.poses(); ++p) {
    pose[p] = field.pose_distance(middle, p);
    block.classes[p] = pose[p].voxel_class;
    for (std::size_t other = 0; other < p; ++other) {
      block.is_in_conflict |= combine(pose[other], pose[p], field.class_threshold()).conflict;
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

/// Stores `wanted` blocks of a brick and follows the surface within it; blocks that it reaches in others are queued.
void BlockGrid::follow(std::vector<Eigen::Vector3i> wanted, const Bricks& bricks, std::size_t brick, const Field& field,
                       const Context& context, std::vector<bool>& is_queued,
                       std::vector<std::vector<Eigen::Vector3i>>& queue) {
  while (!wanted.empty() && blocks_.size() + wanted.size() <= kMaxBlocks && !context.stopped()) {
    const std::size_t first = blocks_.size();
    blocks_.resize(first + wanted.size());
    parallel_for(wanted.size(), [&](std::size_t i) {
      blocks_[first + i].index = wanted[i];
      if (!context.stopped()) evaluate(field, blocks_[first + i]);
    });
    for (std::size_t i = 0; i < wanted.size(); ++i) slot_[linear(wanted[i])] = static_cast<std::int32_t>(first + i);
    wanted.clear();
    for (std::size_t i = first; i < blocks_.size(); ++i) {
      for (const auto& other : open_neighbours(blocks_[i])) {
        if (is_queued[linear(other)]) continue;
        is_queued[linear(other)] = true;
        const std::size_t its = bricks.of(position(kBlockSide * other));
        (its == brick ? wanted : queue[its]).push_back(other);
      }
    }
  }
  queue[brick].insert(queue[brick].end(), wanted.begin(), wanted.end());  // of a grid that is full
}

Result<void> BlockGrid::fill(Field& field, std::vector<Eigen::Vector3f> seeds, const Context& context) {
  if (size_.cast<double>().prod() > kMaxBlocksInBox) {
    return fail(ErrorCode::out_of_range, "volume: {} x {} x {} blocks of 8 voxels exceed the limit; use larger voxels",
                size_.x(), size_.y(), size_.z());
  }
  classify_blocks(field);
  if (context.stopped()) return fail(ErrorCode::stopped, "volume: stopped");
  const Bricks& bricks = field.bricks();
  std::vector<std::vector<Eigen::Vector3i>> queue(bricks.count());
  std::vector<bool> is_queued(slot_.size());
  for (const auto& block : seed_blocks(seeds)) {
    is_queued[linear(block)] = true;
    queue[bricks.of(position(kBlockSide * block))].push_back(block);
  }
  seeds = {};  // many, of large images
  const auto is_waiting = [](const auto& blocks) { return !blocks.empty(); };
  while (std::ranges::any_of(queue, is_waiting)) {
    for (std::size_t brick = 0; brick < queue.size(); ++brick) {
      if (queue[brick].empty()) continue;
      field.focus(brick);
      follow(std::exchange(queue[brick], {}), bricks, brick, field, context, is_queued, queue);
      if (context.stopped()) return fail(ErrorCode::stopped, "volume: stopped");
      if (!queue[brick].empty()) {
        return fail(ErrorCode::out_of_range,
                    "volume: the surface needs more than {} blocks of 8 voxels; use larger voxels", kMaxBlocks);
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

float BlockGrid::set(const Eigen::Vector3i& node, float distance, float band_mm) {
  const auto block_of = [](const Eigen::Vector3i& n) {
    return n.unaryExpr([](int c) { return c / kBlockSide; }).eval();
  };
  for (const auto& face : kFaces) {
    const Eigen::Vector3i other = block_of(node + face);
    if (contains(other)) store(other, band_mm);
  }
  const Eigen::Vector3i local = node - kBlockSide * block_of(node);
  return std::exchange(store(block_of(node), band_mm).distance[Block::node(local.x(), local.y(), local.z())], distance);
}

void BlockGrid::forget_blocks_after(std::size_t count) {
  for (std::size_t i = count; i < blocks_.size(); ++i) {
    slot_[linear(blocks_[i].index)] = blocks_[i].distance[0] < 0.0F ? kInside : kOutside;
  }
  blocks_.resize(count);
}

}  // namespace scanrig
