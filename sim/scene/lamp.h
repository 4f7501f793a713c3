#pragma once

#include "sim/scene/dot_pattern.h"
#include "sim/scene/effects.h"
#include "sim/scene/optics.h"

namespace scanrig::sim {

/// The projector's light in one view.
/// Threads: const functions from any.
class Lamp {
 public:
  /// `finger`: share of the light that a finger in the beam takes.
  Lamp(const Eye& projector, const DotPattern& dots, const Effects& effects, double finger);

  [[nodiscard]] const Eigen::Vector3d& place() const { return place_; }

  /// A point of the raster in whose light a surface is.
  struct Beam {
    double u, v;   ///< projector pixels
    double depth;  ///< mm along the projector's axis
    double sigma;  ///< of the averaging, projector pixels
  };
  /// The beam on `point` (turntable frame), averaged by a Gaussian of `sigma_mm` on the surface.
  [[nodiscard]] Beam beam(const Eigen::Vector3d& point, double sigma_mm) const;
  /// Irradiance on a surface in `beam` whose normal is at `cosine` to the lamp; dots included. 1: full scale on white.
  [[nodiscard]] double irradiance(const Beam& beam, double cosine) const;
  /// The same with all dots averaged.
  [[nodiscard]] double mean_irradiance(const Beam& beam, double cosine) const;

 private:
  [[nodiscard]] double strength(const Beam& beam) const;

  const Eye& projector_;
  const DotPattern& dots_;
  double black_, falloff_, rounding_, finger_;
  Eigen::Vector3d place_;
  double focus_;
};

}  // namespace scanrig::sim
