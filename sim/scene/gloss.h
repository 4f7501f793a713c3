#pragma once

#include <Eigen/Core>

namespace scanrig::sim {

/// Mirrored light of a rough surface: microfacets after GGX, heights correlated after Smith, Fresnel after Schlick
/// [Walter et al. 2007; Heitz 2014, eq. 99; Schlick 1994].
struct Gloss {
  double alpha = 1.0;               ///< width of the lobe: roughness squared [Burley 2012]
  double normal_reflectance = 0.0;  ///< mirrored share at right angles, F0; 0: no gloss

  /// Light towards the eye per light that arrives (irradiance, cosine included), in units in which a white matt surface
  /// gives 1. Unit vectors; 0 where either looks at the back.
  [[nodiscard]] double towards(const Eigen::Vector3d& normal, const Eigen::Vector3d& to_eye,
                               const Eigen::Vector3d& to_light) const;
  /// The same lobe for a light that is not a point: `half_angle` of its disc, radians. The lobe's energy is kept.
  [[nodiscard]] Gloss widened(double half_angle) const;
  /// Share of the surroundings' light that is mirrored, seen at that cosine.
  [[nodiscard]] double mirrored(double cosine) const;
};

/// Density of microfacets around the normal, whose cosine-weighted sum over the hemisphere is 1.
double ggx_density(double alpha, double cosine);

}  // namespace scanrig::sim
