#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"

namespace scanrig {

/// The eyes of the rig, in the turntable frame: a point is measured where both cameras see it and the projector lights
/// it.
struct RigEyes {
  Camera left, right;
  Eigen::Vector3d projector = Eigen::Vector3d::Zero();
};

/// A calibration does not hold the projector: it stands this far above the middle between the cameras, as a rig is
/// built; the light of one that stands 50 mm elsewhere falls 4 deg otherwise.
constexpr double kProjectorAboveMm = 90.0;
RigEyes rig_eyes(const Calibration& calibration);

struct SightOptions {
  double max_incidence_deg = 70.0;  ///< to cameras and projector: beyond it stereo hardly matches
  double min_height_mm = 0.5;       ///< above the table
  double margin_px = 8.0;           ///< inside both images
  double lift_mm = 0.2;             ///< a ray starts this far off the surface: what the facets of a mesh may be off
};

/// In how many of the views at these table angles the rig measures each sample of a solid's surface, counted to
/// `enough`. By ray casting against the solid and its plane y = 0. `samples` and `surface` are in the solid's frame.
/// Threads: spread over the current arena, same result for any number.
std::vector<std::uint8_t> views_that_see(std::span<const SurfaceSample> samples, const SurfaceIndex& surface,
                                         const Transform& turntable_from_solid, std::span<const double> angles_rad,
                                         const RigEyes& eyes, const SightOptions& options = {},
                                         std::uint8_t enough = std::numeric_limits<std::uint8_t>::max());

}  // namespace scanrig
