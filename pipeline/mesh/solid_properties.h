#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

struct SolidProperties {
  double volume_mm3 = 0.0;
  double area_mm2 = 0.0;
  Eigen::Vector3d centre_of_mass = Eigen::Vector3d::Zero();  ///< of the evenly filled solid, not of its vertices, mm
  double size_mm = 0.0;                                      ///< diagonal of the box around it
};

/// Volume and centre of mass by the divergence theorem. Fails with `not_closed` (an edge without its opposite) and
/// `degenerate` (no volume, or inside out).
Result<SolidProperties> solid_properties(const Mesh& mesh);

double surface_area(const Mesh& mesh);

/// Unit normals, one per vertex, faces weighted by their angle at the vertex; zero for a vertex without faces.
std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh);

}  // namespace scanrig
