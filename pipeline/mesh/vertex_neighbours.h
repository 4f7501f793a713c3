#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// The vertices that share an edge with each vertex, each once, in ascending order.
class VertexNeighbours {
 public:
  explicit VertexNeighbours(const Mesh& mesh);

  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t vertex) const {
    return {list_.data() + first_[vertex], list_.data() + first_[vertex + 1]};
  }

  /// Rounds of smoothed() that make a Gaussian of this width on the mesh, at least one and at most 200.
  [[nodiscard]] int rounds_for(const Mesh& mesh, float width_mm) const;

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

  std::vector<std::uint32_t> first_, list_;  ///< offsets into the list, one more than vertices
};

}  // namespace scanrig
