#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <vector>

#include "pipeline/mesh/mesh.h"
#include "pipeline/mesh/solid_properties.h"
#include "sim/scene/polygonise.h"

/// Models of artefacts as a perfect scanner would make them, and the errors of a real one, all of known size.
namespace scanrig::artefact_mesh {

using Eigen::Vector3d;
using Field = std::function<double(const Vector3d&)>;

inline constexpr double kCellMm = 0.6;

inline double ball(const Vector3d& p, const Vector3d& centre, double radius) { return (p - centre).norm() - radius; }

inline double rod(const Vector3d& p, const Vector3d& from, const Vector3d& to, double radius) {
  const double t = std::clamp((p - from).dot(to - from) / (to - from).squaredNorm(), 0.0, 1.0);
  return (p - from - t * (to - from)).norm() - radius;
}

inline double box(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  return (low - p).cwiseMax(p - high).maxCoeff();
}

/// Vertices on the zero set, all measured by two views.
inline Mesh model(const Field& field, const Vector3d& low, const Vector3d& high, double cell = kCellMm) {
  const Vector3d off(0.113, 0.171, 0.139);  // no face on the lattice's nodes
  const auto solid = sim::polygonise(field, {low - off, high + off}, cell, 1.5);
  Mesh mesh;
  for (const auto& v : solid.vertices) mesh.vertices.push_back(v.cast<float>());
  for (const auto& t : solid.triangles) {
    mesh.faces.push_back(
        {static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]), static_cast<std::uint32_t>(t[2])});
  }
  mesh.views.assign(mesh.vertices.size(), 2);
  mesh.sigma.assign(mesh.vertices.size(), 0.001F);
  return mesh;
}

inline const Vector3d kCentre(3.0, 28.0, -2.0);

/// A ball on a stem on a foot. `radius` by the direction from its centre.
inline Mesh ball_on_stem(const std::function<double(const Vector3d&)>& radius) {
  const auto field = [&](const Vector3d& p) {
    const Vector3d away = p - kCentre;
    const double stem = rod(p, {kCentre.x(), 0.0, kCentre.z()}, kCentre, 3.0);
    const double foot = box(p, {-15.0, -3.0, -15.0}, {18.0, 4.0, 15.0});
    const double out = away.norm() < 1.0 ? -1.0 : away.norm() - radius(away.normalized());
    return std::min({out, stem, foot});
  };
  return model(field, {-18.0, -6.0, -18.0}, {21.0, 44.0, 18.0});
}

/// A perfect one; each size is made once.
inline const Mesh& ball_on_stem(double radius) {
  static std::map<double, Mesh> made;
  const auto known = made.find(radius);
  if (known != made.end()) return known->second;
  return made.emplace(radius, ball_on_stem([radius](const Vector3d&) { return radius; })).first->second;
}

/// Moves each vertex along its normal.
inline void move_along_normals(Mesh& mesh, const std::vector<double>& by_mm) {
  const auto normals = vertex_normals(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] += static_cast<float>(by_mm[i]) * normals[i];
  }
}

/// Indices of points by the cube of space that they are in.
class Cubes {
 public:
  Cubes(const std::vector<Eigen::Vector3f>& points, double side) : side_(side) {
    for (std::size_t i = 0; i < points.size(); ++i) cubes_[cube_of(points[i])].push_back(i);
  }
  /// Those within a side of `at`, and some beyond.
  template <class Use>
  void around(const Eigen::Vector3f& at, const Use& use) const {
    const auto middle = cube_of(at);
    for (int k = 0; k < 27; ++k) {
      const auto found = cubes_.find({middle[0] + k % 3 - 1, middle[1] + k / 3 % 3 - 1, middle[2] + k / 9 - 1});
      if (found != cubes_.end()) std::ranges::for_each(found->second, use);
    }
  }

 private:
  [[nodiscard]] std::array<int, 3> cube_of(const Eigen::Vector3f& p) const {
    const Eigen::Vector3i floor = (p.cast<double>() / side_).array().floor().cast<int>();
    return {floor.x(), floor.y(), floor.z()};
  }

  double side_;
  std::map<std::array<int, 3>, std::vector<std::size_t>> cubes_;
};

/// Normal errors of `sigma`; with `alike_mm` those of points so near are alike: means of independent ones around.
inline std::vector<double> errors(const Mesh& mesh, double sigma, double alike_mm, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<double> white(mesh.vertices.size());
  for (double& value : white) value = normal(random);
  if (alike_mm <= 0.0) {
    for (double& value : white) value *= sigma;
    return white;
  }
  std::vector<double> smooth(white.size(), 0.0);
  const double reach = 2.0 * alike_mm;
  const Cubes cubes(mesh.vertices, reach);
  for (std::size_t i = 0; i < white.size(); ++i) {
    double squares = 0.0;
    cubes.around(mesh.vertices[i], [&](std::size_t j) {
      const double squared = static_cast<double>((mesh.vertices[i] - mesh.vertices[j]).squaredNorm());
      if (squared >= reach * reach) return;
      const double share = 1.0 - squared / (reach * reach), weight = share * share;
      smooth[i] += weight * white[j];
      squares += weight * weight;
    });
    smooth[i] *= sigma / std::sqrt(squares);
  }
  return smooth;
}

}  // namespace scanrig::artefact_mesh
