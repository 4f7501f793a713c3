#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"

namespace scanrig {

struct SelfMatchOptions {
  std::size_t samples = 600;      ///< of the measured surface
  double tolerance = 0.004;       ///< share of the solid's size that partial models are off
  double min_tolerance_mm = 0.3;  ///< at least, and half an edge of the mesh
  double max_outside = 0.01;      ///< share of the samples that a turn may carry into free space
  double min_known = 0.5;         ///< share of the samples that it must carry beside measured surface
  double alike = 0.15;            ///< principal moments of the surface that differ by less may be one
};

/// A turn of a solid after which its measured surface lies on itself.
struct SelfMatch {
  Eigen::Vector3d axis;  ///< unit, through the middle of the surface
  double angle_deg = 0.0;
};

/// The first such turn among those about the vertical, and about the principal axes of the surface, each with an
/// alignment from there; nothing where none fits. A sample must not come to lie outside the solid, whose unmeasured
/// surface bounds the object; inside it may. Of a mesh with `views`; `measured`: samples of its measured faces.
/// Threads: spread over the current arena, same result for any number.
std::optional<SelfMatch> find_self_match(const Mesh& solid, const SurfaceIndex& surface,
                                         std::span<const SurfaceSample> measured, double size_mm,
                                         const SelfMatchOptions& options = {});

}  // namespace scanrig
