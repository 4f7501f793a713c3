#pragma once

namespace scanrig {

/// What the voxels of a model may measure, the same for all who ask for one: configuration, API and command line.
constexpr double kMinVoxelMm = 0.02, kMaxVoxelMm = 5.0;

}  // namespace scanrig
