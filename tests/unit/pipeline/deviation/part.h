#pragma once

#include "core/transform.h"
#include "tests/unit/pipeline/pose/solid_mesh.h"

/// A part without symmetry, by its equations, and ways to lay it elsewhere.
namespace scanrig::deviation_part {

inline const Eigen::Vector3d kMiddle(0.0, 25.0, 0.0);

inline testing::Solid part() {
  return testing::together({testing::block({-30, 0, -20}, {30, 15, 20}), testing::ball({-12, 18, 4}, 14),
                            testing::upright_cylinder({18, 0, -8}, 8, 48)});
}

inline Mesh part_mesh(double cell_mm) { return testing::mesh_of(part(), {-34, -4, -24}, {34, 52, 24}, cell_mm); }

inline Transform some_motion(double turn_deg) {
  Transform motion = Transform::Identity();
  motion.linear() = Eigen::AngleAxisd(turn_deg * 3.14159265358979 / 180.0, Eigen::Vector3d(1, 2, -0.5).normalized())
                        .toRotationMatrix();
  motion.translation() << 310.0, -45.0, 12.0;
  return motion;
}

inline Mesh moved_mesh(Mesh mesh, const Transform& motion) {
  for (auto& vertex : mesh.vertices) vertex = (motion * vertex.cast<double>()).cast<float>();
  return mesh;
}

}  // namespace scanrig::deviation_part
