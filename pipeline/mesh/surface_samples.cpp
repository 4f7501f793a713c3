#include "pipeline/mesh/surface_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace scanrig {
namespace {

/// Twice the area times the normal.
Eigen::Vector3d area_vector(const Mesh& mesh, const Mesh::Face& face) {
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  return (mesh.vertices[face[1]].cast<double>() - a).cross(mesh.vertices[face[2]].cast<double>() - a);
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const Mesh& mesh, const std::vector<std::uint32_t>& faces,
                                          std::size_t count) {
  std::vector<SurfaceSample> samples;
  const double step = area_of(mesh, faces) / static_cast<double>(count);
  if (!(step > 0.0)) return samples;
  samples.reserve(count);
  double area = 0.0;
  for (const std::uint32_t face : faces) {
    const Eigen::Vector3d normal = area_vector(mesh, mesh.faces[face]);
    area += 0.5 * normal.norm();
    while (samples.size() < count && (static_cast<double>(samples.size()) + 0.5) * step <= area) {
      // The R2 sequence: additive recurrence of the plastic number, folded into the triangle.
      const auto k = static_cast<double>(samples.size());
      double u = std::fmod(0.5 + 0.7548776662466927 * k, 1.0);
      double v = std::fmod(0.5 + 0.5698402909980532 * k, 1.0);
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      SurfaceSample sample{Eigen::Vector3d::Zero(), normal.normalized(), face, {1.0 - u - v, u, v}};
      for (int i = 0; i < 3; ++i) sample.point += sample.weights[i] * mesh.vertices[mesh.faces[face][i]].cast<double>();
      samples.push_back(sample);
    }
  }
  return samples;
}

double area_of(const Mesh& mesh, const std::vector<std::uint32_t>& faces) {
  double area = 0.0;
  for (const std::uint32_t face : faces) area += 0.5 * area_vector(mesh, mesh.faces[face]).norm();
  return area;
}

std::vector<std::uint32_t> measured_faces(const Mesh& mesh, bool measured) {
  std::vector<std::uint32_t> faces;
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    const Mesh::Face& f = mesh.faces[i];
    const bool seen = mesh.views.empty() || (mesh.views[f[0]] > 0 && mesh.views[f[1]] > 0 && mesh.views[f[2]] > 0);
    if (seen == measured) faces.push_back(i);
  }
  return faces;
}

}  // namespace scanrig
