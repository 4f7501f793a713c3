#include "pipeline/volume/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/volume/untangle.h"

namespace scanrig {
namespace {

constexpr std::size_t kChunk = 4096;  // vertices per task

/// Each vertex's neighbours, row after row.
struct Adjacency {
  std::vector<std::uint32_t> first, neighbour;
};

Adjacency adjacency(const Mesh& mesh) {
  // In a closed manifold every directed edge occurs once: a vertex's neighbours are the heads of its edges.
  Adjacency result;
  result.first.assign(mesh.vertices.size() + 1, 0);
  for (const auto& f : mesh.faces) {
    for (const auto v : f) ++result.first[v + 1];
  }
  for (std::size_t i = 1; i < result.first.size(); ++i) result.first[i] += result.first[i - 1];
  std::vector<std::uint32_t> fill = result.first;
  result.neighbour.resize(3 * mesh.faces.size());
  for (const auto& f : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) result.neighbour[fill[f[k]]++] = f[(k + 1) % 3];
  }
  return result;
}

/// Smooths staircases of the carved surface; a vertex stays within half a voxel of where it was.
void smooth_unmeasured(float voxel_mm, int rounds, Mesh& mesh) {
  const Adjacency around = adjacency(mesh);
  const std::vector<Eigen::Vector3f> original = mesh.vertices;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<Eigen::Vector3f> before = mesh.vertices;
    for (std::size_t v = 0; v < before.size(); ++v) {
      if (mesh.views[v] != 0 || around.first[v] == around.first[v + 1]) continue;
      Eigen::Vector3f mean = Eigen::Vector3f::Zero();
      for (auto i = around.first[v]; i < around.first[v + 1]; ++i) mean += before[around.neighbour[i]];
      mean /= static_cast<float>(around.first[v + 1] - around.first[v]);
      Eigen::Vector3f move = 0.5F * (before[v] + mean) - original[v];
      const float length = move.norm();
      if (length > 0.5F * voxel_mm) move *= 0.5F * voxel_mm / length;
      mesh.vertices[v] = original[v] + move;
    }
  }
}

/// One step along the measured normal; `views` and `sigma` where the vertex ends on measured surface.
void settle_vertex(const Field& field, const VolumeOptions& options, const Eigen::Vector3f& outward, Mesh& mesh,
                   std::vector<Scatter>& scatter, std::size_t v) {
  Eigen::Vector3f& position = mesh.vertices[v];
  PointEvidence evidence = field.evidence_at(position);
  if (evidence.views == 0 || evidence.normal.dot(outward) < options.min_agreement) return;
  const float reach = 0.5F * static_cast<float>(options.voxel_mm);
  if (std::abs(evidence.surface_distance) > reach) return;
  const Eigen::Vector3f moved = position - evidence.surface_distance * evidence.normal;
  evidence = field.evidence_at(moved);
  if (evidence.views == 0 || std::abs(evidence.surface_distance) > 0.2F * reach) return;
  position = moved;
  mesh.views[v] = static_cast<std::uint8_t>(std::min(evidence.views, 255));
  mesh.sigma[v] = evidence.sigma;
  scatter[v] = evidence.scatter;
}

/// Sums over the neighbours, round after round: a Gaussian whose width is the root of so many edges.
void spread(const Adjacency& around, int rounds, std::vector<Scatter>& scatter) {
  std::vector<Scatter> before;
  for (int round = 0; round < rounds; ++round) {
    before = scatter;
    parallel_for((scatter.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
      for (std::size_t v = chunk * kChunk; v < std::min(scatter.size(), (chunk + 1) * kChunk); ++v) {
        Scatter sum = before[v];
        for (auto i = around.first[v]; i < around.first[v + 1]; ++i) {
          sum.sum += before[around.neighbour[i]].sum;
          sum.count += before[around.neighbour[i]].count;
        }
        const auto of = static_cast<float>(1 + around.first[v + 1] - around.first[v]);
        scatter[v] = {sum.sum / of, sum.count / of};
      }
    });
  }
}

/// Where the views around scatter more than their sigmas let expect, sigma is larger by that [the Birge ratio].
void widen_sigma(const VolumeOptions& options, std::vector<Scatter>& scatter, Mesh& mesh) {
  constexpr float kTooFew = 1e-3F;  // views around, after the spreading
  spread(adjacency(mesh), options.scatter_rounds, scatter);
  for (std::size_t v = 0; v < mesh.sigma.size(); ++v) {
    if (scatter[v].count > kTooFew) mesh.sigma[v] *= std::max(1.0F, scatter[v].sum / scatter[v].count);
  }
}

}  // namespace

Result<void> finish_surface(const Field& field, const VolumeOptions& options, Mesh& mesh) {
  const std::size_t count = mesh.vertices.size();
  mesh.views.assign(count, 0);
  mesh.sigma.assign(count, std::numeric_limits<float>::quiet_NaN());
  const std::vector<Eigen::Vector3f> outward = vertex_normals(mesh), extracted = mesh.vertices;
  std::vector<Scatter> scatter(count);
  parallel_for((count + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    const std::size_t end = std::min(count, (chunk + 1) * kChunk);
    for (std::size_t v = chunk * kChunk; v < end; ++v) settle_vertex(field, options, outward[v], mesh, scatter, v);
  });
  widen_sigma(options, scatter, mesh);
  smooth_unmeasured(static_cast<float>(options.voxel_mm), options.smoothing_rounds, mesh);
  if (options.untangle) {
    if (const auto back = untangle(extracted, mesh); !back) return pass_on(back);
  }
  mesh.normals = vertex_normals(mesh);
  return {};
}

}  // namespace scanrig
