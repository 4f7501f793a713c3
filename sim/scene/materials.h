#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/result.h"
#include "sim/scene/effects.h"
#include "sim/scene/gloss.h"
#include "sim/scene/surface_colour.h"

namespace scanrig::sim {

/// What a surface does with light, beside its colour.
struct Material {
  const char* name = "matt";
  double roughness = 1.0;
  double normal_reflectance = 0.0;
  double scattered = 0.0;        ///< share of the light that leaves the surface a little beside where it entered
  double scatter_mm = 0.0;       ///< sigma of how far beside
  double scatter_deep_mm = 0.0;  ///< mean depth from which it comes
  double glow = 0.0;             ///< share that leaves it far beside, without dots
  /// Its colour in place of the object's own; nullptr: the object's own.
  Eigen::Vector3f (*colour)(const Eigen::Vector3f& own, const Eigen::Vector3d& in_object) = nullptr;

  [[nodiscard]] Gloss gloss() const { return {roughness * roughness, normal_reflectance}; }
};

/// Materials of an object: one, or several in patches of about 17 mm.
/// Threads: const functions from any.
class Materials {
 public:
  /// Matt all over: profile 1.
  Materials() : list_(1) {}
  /// `names`: of materials(), one, or several joined by '+'. Fails with `not_found` (lists those there are).
  static Result<Materials> named(const std::string& names, const Effects& effects);

  [[nodiscard]] const Material& at(const Eigen::Vector3d& in_object) const;
  /// The object's colour where a material has none of its own.
  [[nodiscard]] std::shared_ptr<const SurfaceColour> coloured(std::shared_ptr<const SurfaceColour> own) const;

 private:
  std::vector<Material> list_;
};

/// All of them, by name.
const std::vector<Material>& all_materials();

}  // namespace scanrig::sim
