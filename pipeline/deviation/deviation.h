#pragma once

#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Signed distances of a model's vertices from a reference, and figures of the known ones.
struct Deviation {
  /// One per vertex, mm; positive: outside the reference. NaN: the vertex is not measured, the nearest surface looks
  /// the other way, or the reference ends there.
  std::vector<float> mm;
  double known_share = 0.0;  ///< of the vertices
  double mean_mm = 0.0;
  double rms_mm = 0.0;
  double p95_mm = 0.0;  ///< of the absolute values
  double min_mm = 0.0, max_mm = 0.0;
};

/// Nearest distances with the sign of the reference's angle-weighted normal there [Baerentzen and Aanaes 2005]. Both
/// meshes in mm, faces outwards; a model without `views` counts as measured. Fails with `degenerate` (no vertex is
/// known, no face), `stopped`.
Result<Deviation> deviation_from(const Mesh& reference, const Mesh& model, const Transform& reference_from_model,
                                 const Context& context = {});

}  // namespace scanrig
