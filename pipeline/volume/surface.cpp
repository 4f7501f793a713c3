#include "pipeline/volume/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel_blocks.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/vertex_neighbours.h"
#include "pipeline/volume/denoise.h"
#include "pipeline/volume/untangle.h"

namespace scanrig {
namespace {

/// Smooths staircases of the carved surface; a vertex stays within half a voxel of where it was.
void smooth_unmeasured(const VertexNeighbours& around, float voxel_mm, int rounds, Mesh& mesh) {
  const std::vector<Eigen::Vector3f> original = mesh.vertices;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<Eigen::Vector3f> before = mesh.vertices;
    for (std::size_t v = 0; v < before.size(); ++v) {
      if (mesh.views[v] != 0 || around.of(v).empty()) continue;
      Eigen::Vector3f mean = Eigen::Vector3f::Zero();
      for (const std::uint32_t n : around.of(v)) mean += before[n];
      mean /= static_cast<float>(around.of(v).size());
      Eigen::Vector3f move = 0.5F * (before[v] + mean) - original[v];
      const float length = move.norm();
      if (length > 0.5F * voxel_mm) move *= 0.5F * voxel_mm / length;
      mesh.vertices[v] = original[v] + move;
    }
  }
}

/// Beside the range images: the mesh, what is kept of each vertex, and in which brick it belongs.
std::uintmax_t bytes_while_settled(const Mesh& mesh) {
  constexpr std::uintmax_t kOfVertex = 3 * sizeof(Eigen::Vector3f) + sizeof(Scatter) + sizeof(float) + 1;
  constexpr std::uintmax_t kWhereItBelongs = 2 * sizeof(std::uint32_t);  // a vector that may have grown
  return mesh.vertices.size() * (kOfVertex + kWhereItBelongs) + mesh.faces.size() * sizeof(Mesh::Face);
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

/// All vertices, each where the views let it stand; how much the views of each scatter.
std::vector<Scatter> settle(Field& field, const VolumeOptions& options, const std::vector<Eigen::Vector3f>& extracted,
                            Mesh& mesh) {
  const std::size_t count = extracted.size();
  mesh.views.assign(count, 0);
  mesh.sigma.assign(count, std::numeric_limits<float>::quiet_NaN());
  const std::vector<Eigen::Vector3f> outward = vertex_normals(mesh);
  std::vector<Scatter> scatter(count);
  if (field.bricks().count() > 1) {
    const std::uintmax_t taken = bytes_while_settled(mesh);
    const std::uintmax_t left = options.memory_bytes - std::min(taken, options.memory_bytes);
    field.divide(std::min(left, options.memory_bytes / 2), options.max_bricks_per_axis);
  }
  field.for_each_in_bricks(
      count, [&](std::size_t v) { return extracted[v]; },
      [&](std::size_t v) { settle_vertex(field, options, outward[v], mesh, scatter, v); });
  return scatter;
}

/// Where the views around scatter more than their sigmas let expect, sigma is larger by that [the Birge ratio].
void widen_by_scatter(const VertexNeighbours& around, int rounds, std::vector<Scatter> scatter, Mesh& mesh) {
  constexpr float kTooFew = 1e-3F;  // views around, after the smoothing
  const std::vector<Scatter> mean = around.smoothed(std::move(scatter), rounds);
  for (std::size_t v = 0; v < mesh.sigma.size(); ++v) {
    if (mean[v].count > kTooFew) mesh.sigma[v] *= std::max(1.0F, mean[v].sum / mean[v].count);
  }
}

}  // namespace

void finish_surface(std::unique_ptr<Field> field, const VolumeOptions& options, Mesh& mesh) {
  const std::vector<Eigen::Vector3f> extracted = mesh.vertices;
  std::vector<Scatter> scatter = settle(*field, options, extracted, mesh);
  const float window_mm = field->window_mm();
  field.reset();  // much memory, of which the rest needs nothing
  {
    const VertexNeighbours around(mesh);
    widen_by_scatter(around, options.scatter_rounds, std::move(scatter), mesh);
    if (options.denoise) denoise(around, *options.denoise, window_mm, mesh);
    smooth_unmeasured(around, static_cast<float>(options.voxel_mm), options.smoothing_rounds, mesh);
  }
  if (options.untangle) untangle(extracted, mesh);
  mesh.normals = vertex_normals(mesh);
}

}  // namespace scanrig
