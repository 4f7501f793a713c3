#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace scanrig::sim {

/// The two nearest of randomly placed points, one in each cell of a grid in space.
struct SolidPatches {
  std::uint64_t first = 0;   ///< random bits of the nearest
  std::uint64_t second = 0;  ///< of the runner-up
  double margin = 0.0;       ///< mm to the border between the two
};

/// At `p` (mm) for cells of `size`; each `salt` below 64 is another set of points.
SolidPatches solid_patches(const Eigen::Vector3d& p, double size, unsigned salt);

}  // namespace scanrig::sim
