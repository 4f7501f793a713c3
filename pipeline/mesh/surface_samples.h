#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// A point of a surface; each point of a set represents the same area.
struct SurfaceSample {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;  ///< unit, of the face
  std::uint32_t face = 0;
  Eigen::Vector3d weights;  ///< barycentric, of the face's three corners
};

/// `count` points spread evenly over the area of the named faces. Always the same points for the same surface; none if
/// the faces have no area.
std::vector<SurfaceSample> sample_surface(const Mesh& mesh, const std::vector<std::uint32_t>& faces, std::size_t count);

double area_of(const Mesh& mesh, const std::vector<std::uint32_t>& faces);  ///< mm^2

/// The faces labelled measured (all three vertices seen by at least one view), or the others. Without labels all faces
/// count as measured.
std::vector<std::uint32_t> measured_faces(const Mesh& mesh, bool measured);

}  // namespace scanrig
