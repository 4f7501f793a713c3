#pragma once

#include "pipeline/volume/block_grid.h"

namespace scanrig {

/// Smooths the unmeasured field with measured nodes held fixed. Slivers of unseen space and threads of free space
/// thinner than two or three voxels disappear; no view has seen their beads and loops. Blocks stay closed.
void relax_unmeasured(BlockGrid& grid, float band_mm, int rounds);

}  // namespace scanrig
