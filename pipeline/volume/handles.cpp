#include "pipeline/volume/handles.h"

#include <algorithm>
#include <cmath>

#include "pipeline/mesh/topology.h"
#include "pipeline/volume/marching_cubes.h"
#include "pipeline/volume/voxel_labels.h"

namespace scanrig {
namespace {

/// Only the films, joined through faces, edges or corners, of at most `max_voxels` voxels.
std::vector<std::size_t> small_films(const VoxelLabels& labels, const std::vector<std::size_t>& voxels,
                                     std::size_t max_voxels) {
  std::vector<std::size_t> result;
  std::vector<bool> seen(voxels.size());
  for (std::size_t start = 0; start < voxels.size(); ++start) {
    if (seen[start]) continue;
    std::vector<std::size_t> film = {start};
    seen[start] = true;
    for (std::size_t next = 0; next < film.size(); ++next) {
      for (int k = 0; k < 27; ++k) {
        const std::size_t other = voxels[film[next]] + labels.step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        const auto found = std::lower_bound(voxels.begin(), voxels.end(), other);
        if (found == voxels.end() || *found != other) continue;
        const auto index = static_cast<std::size_t>(found - voxels.begin());
        if (!seen[index]) film.push_back(index);
        seen[index] = true;
      }
    }
    if (film.size() > max_voxels) continue;
    for (const auto index : film) result.push_back(voxels[index]);
  }
  return result;
}

std::vector<Eigen::Vector3i> nodes_of(const VoxelLabels& labels, const std::vector<std::size_t>& voxels) {
  std::vector<Eigen::Vector3i> nodes;
  nodes.reserve(voxels.size());
  for (const auto i : voxels) nodes.push_back(labels.node(i));
  return nodes;
}

/// Those of films that nothing measured supports.
std::vector<Eigen::Vector3i> unmeasured_films(const BlockGrid& grid, bool cutting, const VolumeOptions& options) {
  VoxelLabels labels(grid);
  labels.doubt_unmeasured(grid, options.doubt_reach_mm);
  const std::vector<std::size_t> films = labels.grow(/*inside=*/cutting);
  const auto max_voxels = static_cast<std::size_t>(std::pow(options.max_filled_mm / grid.voxel(), 2.0F));
  return nodes_of(labels, cutting ? films : small_films(labels, films, max_voxels));
}

/// Those of films below the resolution, measured or not.
std::vector<Eigen::Vector3i> thin_films(const BlockGrid& grid, bool cutting, const VolumeOptions& options) {
  VoxelLabels labels(grid);
  labels.doubt_thin(grid, options.thin_layers);
  std::vector<std::size_t> films = labels.grow(/*inside=*/cutting);
  std::erase_if(films, [&](std::size_t i) { return !labels.closes_short_loop(i, cutting, options.short_loop); });
  return nodes_of(labels, films);
}

/// Flips voxels; the change is kept if it leaves fewer handles.
std::size_t flip_if_better(BlockGrid& grid, Mesh& surface, const std::vector<Eigen::Vector3i>& nodes, float distance,
                           float band_mm, long& genus) {
  if (nodes.empty()) return 0;
  const std::size_t blocks = grid.blocks().size();
  std::vector<float> before;
  before.reserve(nodes.size());
  for (const auto& node : nodes) before.push_back(grid.set(node, distance, band_mm));
  Mesh all = extract_surface(grid);
  const long after = genus_of_largest(all);
  if (after >= genus) {
    for (std::size_t i = 0; i < nodes.size(); ++i) grid.set(nodes[i], before[i], band_mm);
    grid.forget_blocks_after(blocks);
    return 0;
  }
  genus = after;
  surface = std::move(all);
  return nodes.size();
}

}  // namespace

HandleRepair repair_handles(BlockGrid& grid, Mesh& surface, long genus, float band_mm, const VolumeOptions& options) {
  HandleRepair result{0, 0, genus};
  // Cut first: space that no view saw may be empty, space that a view saw through is.
  for (const auto films : {unmeasured_films, thin_films}) {
    for (const bool cutting : {true, false}) {
      if (result.genus <= 0) return result;
      const float shallow = 0.5F * grid.voxel();  // a flipped voxel's distance: the film is about a voxel thick
      const std::size_t flipped = flip_if_better(grid, surface, films(grid, cutting, options),
                                                 cutting ? shallow : -shallow, band_mm, result.genus);
      (cutting ? result.cut : result.filled) += flipped;
    }
  }
  return result;
}

}  // namespace scanrig
