#pragma once

#include <vector>

#include "core/result.h"
#include "pipeline/acceptance/gauss_fit.h"

namespace scanrig::acceptance {

struct PlaneOptions {
  double max_normal_deg = 30.0;  ///< points whose normals lean more from the plane's are other surface
  /// Points farther from the plane than this share of its size (root of its area) and 6 sigma are other surface.
  double band_share = 0.02;
  double min_area_share = 0.05;  ///< of the measured surface: smaller ones are no plane
};

struct FoundPlanes {
  std::vector<Region> regions;
  PlanesFit fit;
};

/// The largest flat face of what is measured. Fails with `not_found` (none).
Result<FoundPlanes> find_plane(const MeasuredSurface& surface, const PlaneOptions& options = {});

/// Parallel faces at these heights over the lowest of them, along their common outward normal; the lowest first.
/// `heights_mm` ascend and are above 0. Fails with `not_found`.
Result<FoundPlanes> find_steps(const MeasuredSurface& surface, const std::vector<double>& heights_mm,
                               const PlaneOptions& options = {});

}  // namespace scanrig::acceptance
