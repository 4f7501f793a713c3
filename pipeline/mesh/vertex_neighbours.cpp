#include "pipeline/mesh/vertex_neighbours.h"

#include <cmath>

namespace scanrig {

VertexNeighbours::VertexNeighbours(const Mesh& mesh) : first_(mesh.vertices.size() + 1, 0) {
  // Each edge of a face, both ways; inner edges come twice, so doubles are dropped.
  for (const auto& f : mesh.faces) {
    for (const auto v : f) first_[v + 1] += 2;
  }
  for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
  list_.resize(first_.back());
  std::vector<std::uint32_t> fill = first_;
  for (const auto& f : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      list_[fill[f[k]]++] = f[(k + 1) % 3];
      list_[fill[f[k]]++] = f[(k + 2) % 3];
    }
  }
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v + 1 < first_.size(); ++v) {
    const auto from = list_.begin() + first_[v], to = list_.begin() + first_[v + 1];
    std::sort(from, to);
    const auto last = std::unique(from, to);
    first_[v] = kept;
    kept = static_cast<std::uint32_t>(std::copy(from, last, list_.begin() + kept) - list_.begin());
  }
  first_.back() = kept;
  list_.resize(kept);
  list_.shrink_to_fit();  // doubles took half of it
}

int VertexNeighbours::rounds_for(const Mesh& mesh, float width_mm) const {
  constexpr int kMaxRounds = 200;
  double squares = 0.0;
  std::size_t edges = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (const std::uint32_t n : of(v)) {
      squares += static_cast<double>((mesh.vertices[v] - mesh.vertices[n]).squaredNorm());
      ++edges;
    }
  }
  const double a_round = 3.0 / 7.0 * squares / static_cast<double>(std::max<std::size_t>(edges, 1));
  const double width = static_cast<double>(width_mm);
  return std::clamp(static_cast<int>(std::lround(width * width / std::max(a_round, 1e-12))), 1, kMaxRounds);
}

}  // namespace scanrig
