#pragma once

#include "pipeline/volume/block_grid.h"

namespace scanrig {

/// Smooths the field where nothing was measured, measured nodes held fixed: slivers of unseen space and threads of free
/// space thinner than two or three voxels go, whose beads and loops no view has seen. Blocks stay closed.
void relax_unmeasured(BlockGrid& grid, float band_mm);

}  // namespace scanrig
