#include "pipeline/volume/denoise.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/parallel_blocks.h"
#include "pipeline/mesh/solid_properties.h"

namespace scanrig {
namespace {

using Placed = Eigen::Vector4f;  ///< position, mm, and the share of measured surface around
constexpr std::size_t kScales = 3;

bool is_measured(const Mesh& mesh, std::size_t v) { return mesh.views[v] != 0 && std::isfinite(mesh.sigma[v]); }

/// Of each vertex, over the quadratics around at the three widths.
struct Beyond {
  std::array<float, kScales> height_mm{};  ///< along the normal
  float measured = 0.0F;                   ///< share of the surface around
};

/// `rounds` of smoothing make the first width, twice as many the next.
std::vector<Beyond> beyond_quadratics(const VertexNeighbours& around, const Mesh& mesh,
                                      const std::vector<Eigen::Vector3f>& normals, int rounds) {
  const std::size_t count = mesh.vertices.size();
  std::vector<Placed> placed(count);
  for (std::size_t v = 0; v < count; ++v) placed[v] << mesh.vertices[v], is_measured(mesh, v) ? 1.0F : 0.0F;
  std::vector<Beyond> result(count);
  std::vector<Placed> once = around.smoothed(std::move(placed), rounds);
  for (std::size_t k = 0; k < kScales; ++k, rounds *= 2) {
    std::vector<Placed> twice = around.smoothed(once, rounds);
    for_each_in_blocks(count, [&](std::size_t v) {
      result[v].height_mm[k] = (mesh.vertices[v] - 2.0F * once[v].head<3>() + twice[v].head<3>()).dot(normals[v]);
      result[v].measured = twice[v].w();
    });
    once = std::move(twice);
  }
  return result;
}

/// Root mean square of the last height of the measured vertices around, mm.
std::vector<float> mean_height(const VertexNeighbours& around, const Mesh& mesh, const std::vector<Beyond>& beyond,
                               int rounds) {
  constexpr float kTooFew = 1e-6F;
  std::vector<Eigen::Vector2f> squares(beyond.size(), Eigen::Vector2f::Zero());
  for (std::size_t v = 0; v < beyond.size(); ++v) {
    const float height = beyond[v].height_mm.back();
    if (is_measured(mesh, v)) squares[v] = {height * height, 1.0F};
  }
  squares = around.smoothed(std::move(squares), rounds);
  std::vector<float> result(beyond.size());
  for (std::size_t v = 0; v < beyond.size(); ++v) {
    result[v] = std::sqrt(squares[v].x() / std::max(squares[v].y(), kTooFew));
  }
  return result;
}

float interpolated(const ByRoughness& at, const ByRoughness& values, float ratio) {
  if (!(ratio > at.front())) return values.front();
  for (std::size_t i = 1; i < at.size(); ++i) {
    if (ratio < at[i]) return std::lerp(values[i - 1], values[i], (ratio - at[i - 1]) / (at[i] - at[i - 1]));
  }
  return values.back();
}

}  // namespace

void denoise(const VertexNeighbours& around, const DenoiseOptions& options, float window_mm, Mesh& mesh) {
  if (!(window_mm > 0.0F)) return;
  const int rounds = around.rounds_for(mesh, 0.5F * window_mm);
  const std::vector<Eigen::Vector3f> normals = vertex_normals(mesh);
  const std::vector<Beyond> beyond = beyond_quadratics(around, mesh, normals, rounds);
  const std::vector<float> mean = mean_height(around, mesh, beyond, rounds << (kScales - 1));
  for_each_in_blocks(mesh.vertices.size(), [&](std::size_t v) {
    if (!is_measured(mesh, v)) return;
    const float ratio = mean[v] / mesh.sigma[v], left = interpolated(options.roughness, options.sigma, ratio) *
                                                        std::max(1.0F, ratio / options.roughness.back());
    if (beyond[v].measured < options.min_measured) {
      mesh.sigma[v] *= std::max(1.0F, left);
      return;
    }
    float noise = 0.0F, finer = 0.0F;
    for (std::size_t k = 0; k < kScales; ++k) {
      noise += interpolated(options.roughness, options.shares[k], ratio) * (beyond[v].height_mm[k] - finer);
      finer = beyond[v].height_mm[k];
    }
    mesh.vertices[v] -= noise * normals[v];
    mesh.sigma[v] *= left;
  });
}

}  // namespace scanrig
