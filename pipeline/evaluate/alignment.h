#pragma once

#include <vector>

#include "core/transform.h"
#include "pipeline/evaluate/surface_samples.h"
#include "pipeline/mesh/surface_index.h"

namespace scanrig {

/// The rigid motion that lays the samples best onto the surface, from where they are: point-to-plane, the worst 10 %
/// of the pairs left out. For figures printed beside those in the absolute frame, which alone are judged.
Transform align(const std::vector<SurfaceSample>& samples, const Mesh& truth, const SurfaceIndex& surface);

}  // namespace scanrig
