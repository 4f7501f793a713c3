#pragma once

#include <functional>

#include "sim/scene/triangle_mesh.h"

namespace scanrig::sim {

/// A box of space to search for a surface.
struct Box {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

/// The zero set of `field` (negative inside, changing by at most `steepness` per mm) as a closed manifold: marching
/// tetrahedra on cubes of `cell` mm, each split into six. Vertices lie on the zero set along the lattice's edges. The
/// surface must not touch the box. Same bits for any number of threads.
TriangleMesh polygonise(const std::function<double(const Eigen::Vector3d&)>& field, const Box& box, double cell,
                        double steepness);

}  // namespace scanrig::sim
