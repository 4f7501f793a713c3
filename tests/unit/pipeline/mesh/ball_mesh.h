#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "pipeline/mesh/mesh.h"

namespace scanrig::ball_mesh {

constexpr double kRadius = 25.0;
inline const Eigen::Vector3d kCentre(0.0, 45.0, 0.0);

/// A ball of triangles of about 0.8 mm.
inline Mesh ball(double radius = kRadius, const Eigen::Vector3d& centre = kCentre, int rings = 100) {
  Mesh mesh;
  const int around = 2 * rings;
  const auto add = [&](double polar, double azimuth) {
    const Eigen::Vector3d direction(std::sin(polar) * std::sin(azimuth), std::cos(polar),
                                    std::sin(polar) * std::cos(azimuth));
    mesh.vertices.push_back((centre + radius * direction).cast<float>());
  };
  add(0.0, 0.0);
  for (int r = 1; r < rings; ++r) {
    for (int a = 0; a < around; ++a) add(std::numbers::pi * r / rings, 2.0 * std::numbers::pi * a / around);
  }
  add(std::numbers::pi, 0.0);
  const auto at = [&](int r, int a) { return static_cast<std::uint32_t>(1 + (r - 1) * around + a % around); };
  const auto south = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  for (int a = 0; a < around; ++a) {
    mesh.faces.push_back({0, at(1, a), at(1, a + 1)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.faces.push_back({at(r, a), at(r + 1, a), at(r + 1, a + 1)});
      mesh.faces.push_back({at(r, a), at(r + 1, a + 1), at(r, a + 1)});
    }
    mesh.faces.push_back({at(rings - 1, a), south, at(rings - 1, a + 1)});
  }
  mesh.views.assign(mesh.vertices.size(), 1);
  return mesh;
}

}  // namespace scanrig::ball_mesh
