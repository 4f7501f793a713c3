#pragma once

#include <vector>

#include "core/transform.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"

namespace scanrig {

struct AlignmentOptions {
  int max_iterations = 15;          ///< Gauss-Newton steps
  std::size_t max_samples = 20000;  ///< of the given ones
  double keep = 0.9;                ///< share of the pairs that is used, the closest ones
};

/// The rigid motion that aligns the samples best with the surface of `target`, from where they are: point-to-plane, the
/// worst 10 % of the pairs left out. `surface` is the index of all its faces.
Transform align(const std::vector<SurfaceSample>& samples, const Mesh& target, const SurfaceIndex& surface,
                const AlignmentOptions& options);

}  // namespace scanrig
