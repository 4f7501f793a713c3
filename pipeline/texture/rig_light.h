#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace scanrig {

/// Brightness of a matte white surface at a place and with an orientation in the rig, relative to the rig's mean. The
/// lamps are fixed while the object turns, so the same spot of paint differs from photo to photo by this factor. One
/// factor per channel: table and backdrop throw coloured light on the surfaces that face them. Second-order spherical
/// harmonics of the normal [Ramamoorthi and Hanrahan 2001: enough for matte surfaces under any distant light] plus a
/// linear term in the position (lamps are near).
struct RigLight {
  static constexpr int kTerms = 12;
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  std::array<Terms, 3> bgr = {Terms::Unit(0), Terms::Unit(0), Terms::Unit(0)};

  /// `normal` unit, `point` mm, both in the turntable frame (fixed to the rig, not to the object).
  static Terms terms(const Eigen::Vector3d& normal, const Eigen::Vector3d& point);
  /// Kept above 0.2: the light model must not amplify noise in the dark.
  [[nodiscard]] Eigen::Vector3f at(const Eigen::Vector3d& normal, const Eigen::Vector3d& point) const;
};

/// One observation of a spot of the surface.
struct LightSample {
  Eigen::Vector3d normal, point;  ///< turntable frame, as in RigLight
  Eigen::Vector3f bgr;            ///< linear, each positive
  double weight = 0.0;
};

/// Fits the light to spots seen several times: colour = paint of the spot * light. Light that cannot be separated from
/// paint (height, when the object only turns) stays 1. Uniform light if no spot was seen twice.
RigLight fit_rig_light(std::span<const std::vector<LightSample>> spots);

}  // namespace scanrig
