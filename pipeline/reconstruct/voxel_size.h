#pragma once

namespace scanrig {

/// Limits of the voxel size of a model, shared by configuration, API and command line.
constexpr double kMinVoxelMm = 0.02, kMaxVoxelMm = 5.0;

/// Voxel size where none is configured.
constexpr double kDefaultVoxelMm = 0.25;

}  // namespace scanrig
