#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig::acceptance {

/// The surface of a model, with what is known of each vertex. mm, in the model's frame.
struct MeasuredSurface {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;  ///< unit, outwards
  std::vector<double> sigma_mm;          ///< along the normal; NaN: not stated
  std::vector<double> area_mm2;          ///< a third of the measured faces around it
  std::vector<double> whole_area_mm2;    ///< the same of all faces
  std::vector<bool> is_measured;         ///< by at least one view; closed surface is not
  std::vector<std::vector<std::uint32_t>> neighbours;
  double spacing_mm = 0.0;  ///< median length of an edge
  double sigma_median_mm = 0.0;

  [[nodiscard]] std::size_t size() const { return points.size(); }
};

/// A model without `views` counts as measured all over; vertices at one place are one. Fails with `degenerate` (no
/// face, or nothing measured).
Result<MeasuredSurface> measured_surface(const Mesh& model);

/// Vertices of an artefact's face or ball.
struct Region {
  std::vector<std::uint32_t> points;  ///< measured, away from the rim
  double area_mm2 = 0.0;              ///< of these
  std::size_t at_rim = 0;             ///< measured, but too near to other surface: not evaluated
};

/// Whether a vertex is where the ideal surface is, within the band, and looks the way it does.
using IsNear = std::function<bool(std::uint32_t vertex)>;

/// The largest connected surface for which `is_near` holds. Patches that it encloses and that are smaller than a disc
/// of `rim_mm` belong to it, however bad they are: they are errors of measurement. Points within `rim_mm` of surface
/// that goes elsewhere, such as a holder or beyond an edge, are left out: matching windows and voxels straddle both.
Region connected_region(const MeasuredSurface& surface, const IsNear& is_near, double rim_mm);

}  // namespace scanrig::acceptance
