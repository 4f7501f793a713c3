#include "pipeline/pose/rig_sight.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "core/units.h"

namespace scanrig {
namespace {

constexpr std::size_t kSamplesPerTask = 64;

Eigen::Vector3d centre_of(const Camera& camera) { return camera.camera_from_turntable.inverse().translation(); }

/// One table angle.
struct Sighting {
  Transform turntable_from_solid;
  std::array<Eigen::Vector3d, 3> eyes;  ///< in the solid's frame
};

bool is_in_image(const Camera& camera, const Eigen::Vector3d& in_turntable, double margin_px) {
  if ((camera.camera_from_turntable * in_turntable).z() <= 0.0) return false;
  const Eigen::Vector2d pixel = camera.project(in_turntable);
  return pixel.allFinite() && camera.projection.contains(pixel, margin_px);
}

/// What is above the table and sees the eyes sees them past the table: they are above it, too.
bool is_seen(const SurfaceSample& sample, const Sighting& view, const SurfaceIndex& surface, const RigEyes& eyes,
             const SightOptions& options) {
  const double min_cosine = std::cos(to_radians(options.max_incidence_deg));
  for (const Eigen::Vector3d& eye : view.eyes) {
    if ((eye - sample.point).normalized().dot(sample.normal) < min_cosine) return false;
  }
  const Eigen::Vector3d in_turntable = view.turntable_from_solid * sample.point;
  for (const Camera* camera : {&eyes.left, &eyes.right}) {
    if (!is_in_image(*camera, in_turntable, options.margin_px)) return false;
  }
  const Eigen::Vector3d start = sample.point + options.lift_mm * sample.normal;
  return std::ranges::none_of(view.eyes, [&](const Eigen::Vector3d& eye) { return surface.blocked(start, eye); });
}

}  // namespace

RigEyes rig_eyes(const Calibration& calibration) {
  const Eigen::Vector3d middle = 0.5 * (centre_of(calibration.left) + centre_of(calibration.right));
  return {calibration.left, calibration.right, middle + kProjectorAboveMm * Eigen::Vector3d::UnitY()};
}

std::vector<std::uint8_t> views_that_see(std::span<const SurfaceSample> samples, const SurfaceIndex& surface,
                                         const Transform& turntable_from_solid, std::span<const double> angles_rad,
                                         const RigEyes& eyes, const SightOptions& options, std::uint8_t enough) {
  std::vector<Sighting> views;
  for (const double angle : angles_rad) {
    const Transform placed = rot_y(angle) * turntable_from_solid;
    const Transform back = placed.inverse();
    views.push_back({placed, {back * centre_of(eyes.left), back * centre_of(eyes.right), back * eyes.projector}});
  }
  std::vector<std::uint8_t> counts(samples.size(), 0);
  parallel_for((samples.size() + kSamplesPerTask - 1) / kSamplesPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(samples.size(), (task + 1) * kSamplesPerTask);
    for (std::size_t i = task * kSamplesPerTask; i < end; ++i) {
      if ((turntable_from_solid * samples[i].point).y() < options.min_height_mm) continue;
      for (const Sighting& view : views) {
        if (counts[i] == enough) break;
        if (is_seen(samples[i], view, surface, eyes, options)) ++counts[i];
      }
    }
  });
  return counts;
}

}  // namespace scanrig
