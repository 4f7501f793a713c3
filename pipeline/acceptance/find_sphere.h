#pragma once

#include <vector>

#include "core/result.h"
#include "pipeline/acceptance/gauss_fit.h"

namespace scanrig::acceptance {

struct SphereOptions {
  double diameter_mm = 0.0;  ///< calibrated
  std::size_t count = 1;     ///< spheres to find
  /// Share of each sphere's surface that must be measured: half, as ISO 10360-5 and -8 probe a sphere.
  double min_seen_share = 0.5;
  /// Points farther from the sphere than this share of its diameter and 6 sigma are no errors but other surface.
  double band_share = 0.05;
  double max_normal_deg = 60.0;      ///< the same of normals that lean more than this from the sphere's
  double max_diameter_share = 0.02;  ///< a sphere that differs by more of its diameter and 6 sigma is another one
};

struct FoundSphere {
  Region region;
  SphereFit fit;
  double seen_share = 0.0;  ///< of the sphere's surface: measured, away from its holder
};

/// Distance from other surface within which points are not evaluated: a matching window and the voxels it spans, in
/// edges of the model. Where windows are wider, as in images of half the size with the same voxels, their errors count.
inline constexpr double kRimEdges = 10.0;

/// The spheres of that diameter among everything measured, the one with most surface first. Each measured point
/// proposes a centre a radius below it; where most of the area agrees is a sphere. Fails with `not_found` (no such
/// sphere, or of another diameter), `degenerate` (too little of it is measured; says how much and how much is needed).
Result<std::vector<FoundSphere>> find_spheres(const MeasuredSurface& surface, const SphereOptions& options);

}  // namespace scanrig::acceptance
