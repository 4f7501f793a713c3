#include "pipeline/volume/vertex_sigma.h"

#include <algorithm>
#include <cmath>

#include "pipeline/mesh/solid_properties.h"

namespace scanrig {
namespace {

/// Rounds of VertexNeighbours::smoothed() that make a Gaussian of this width.
int rounds_for(const VertexNeighbours& around, const Mesh& mesh, float width_mm) {
  constexpr int kMaxRounds = 200;
  double squares = 0.0;
  std::size_t edges = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (const std::uint32_t n : around.of(v)) {
      squares += static_cast<double>((mesh.vertices[v] - mesh.vertices[n]).squaredNorm());
      ++edges;
    }
  }
  const double a_round = 3.0 / 7.0 * squares / static_cast<double>(std::max<std::size_t>(edges, 1));
  const double width = static_cast<double>(width_mm);
  return std::clamp(static_cast<int>(std::lround(width * width / std::max(a_round, 1e-12))), 1, kMaxRounds);
}

}  // namespace

void widen_by_scatter(const VertexNeighbours& around, int rounds, const std::vector<Scatter>& scatter, Mesh& mesh) {
  constexpr float kTooFew = 1e-3F;  // views around, after the smoothing
  const std::vector<Scatter> mean = around.smoothed(scatter, rounds);
  for (std::size_t v = 0; v < mesh.sigma.size(); ++v) {
    if (mean[v].count > kTooFew) mesh.sigma[v] *= std::max(1.0F, mean[v].sum / mean[v].count);
  }
}

void widen_by_fine_shape(const VertexNeighbours& around, float share, float window_mm, Mesh& mesh) {
  if (!(window_mm > 0.0F) || !(share > 0.0F)) return;
  // With G a Gaussian of the window's width, (1 - G)^2 leaves nothing of a quadratic.
  const int rounds = rounds_for(around, mesh, window_mm);
  const std::vector<Eigen::Vector3f> once = around.smoothed(mesh.vertices, rounds),
                                     twice = around.smoothed(once, rounds);
  const std::vector<Eigen::Vector3f> normals = vertex_normals(mesh);
  for (std::size_t v = 0; v < mesh.sigma.size(); ++v) {
    const float beyond = (mesh.vertices[v] - 2.0F * once[v] + twice[v]).dot(normals[v]);
    mesh.sigma[v] = std::hypot(mesh.sigma[v], share * beyond);
  }
}

}  // namespace scanrig
