#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The vertices that share an edge with each vertex of a closed manifold.
class Neighbours {
 public:
  explicit Neighbours(const Mesh& mesh) {
    // Every directed edge occurs once: a vertex's neighbours are the heads of its edges.
    first_.assign(mesh.vertices.size() + 1, 0);
    for (const auto& f : mesh.faces) {
      for (const auto v : f) ++first_[v + 1];
    }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<std::uint32_t> fill = first_;
    neighbour_.resize(3 * mesh.faces.size());
    for (const auto& f : mesh.faces) {
      for (std::size_t k = 0; k < 3; ++k) neighbour_[fill[f[k]]++] = f[(k + 1) % 3];
    }
  }

  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t vertex) const {
    return std::span(neighbour_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

  /// Each value becomes the mean of its own and its neighbours', round after round: a Gaussian whose variance on each
  /// axis is 3/7 of a squared edge a round, where a vertex has six neighbours.
  template <class Value>
  [[nodiscard]] std::vector<Value> smoothed(std::vector<Value> values, int rounds) const {
    std::vector<Value> before;
    for (int round = 0; round < rounds; ++round) {
      before = values;
      parallel_for((values.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
        for (std::size_t v = chunk * kChunk; v < std::min(values.size(), (chunk + 1) * kChunk); ++v) {
          Value sum = before[v];
          for (const std::uint32_t n : of(v)) sum += before[n];
          values[v] = sum / static_cast<float>(1 + of(v).size());
        }
      });
    }
    return values;
  }

 private:
  static constexpr std::size_t kChunk = 4096;  // vertices per task

  std::vector<std::uint32_t> first_, neighbour_;
};

}  // namespace scanrig
