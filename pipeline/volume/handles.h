#pragma once

#include <cstddef>

#include "pipeline/volume/block_grid.h"
#include "pipeline/volume/integrate.h"

namespace scanrig {

struct HandleRepair {
  std::size_t cut = 0;     ///< voxels taken out of the solid
  std::size_t filled = 0;  ///< voxels added to it
  long genus = 0;          ///< of the largest component, after the repair
};

/// Removes handles that are not supported by measurements, `genus` of them or fewer. A set is rebuilt from its certain
/// voxels (those nearer to measured surface than to closed) by adding doubtful ones only where that makes no new loop
/// (simple points). What cannot be added is a film: across a doubtful tunnel it is filled if small, across a doubtful
/// bridge it is cut. Loops among certain voxels stay: they were measured, or looked through. Last, measured or not,
/// what is below the resolution: short loops through thin solid are cut, through thin space filled. `surface`: the
/// extracted surface of `grid`, before and after.
HandleRepair repair_handles(BlockGrid& grid, Mesh& surface, long genus, float band_mm, const VolumeOptions& options);

}  // namespace scanrig
