#include "pipeline/volume/marching_cubes.h"

#include <gtest/gtest.h>

#include <set>

namespace scanrig {
namespace {

/// Corners joined by an edge of the cell, from the header's description alone.
std::pair<int, int> ends(int edge) {
  const int axis = edge / 4, k = edge % 4;
  const int first = (axis + 1) % 3, second = (axis + 2) % 3;
  const int low = std::min(first, second), high = std::max(first, second);
  const int start = (k & 1) << low | (k >> 1) << high;
  return {start, start | 1 << axis};
}

TEST(MarchingCubes, TrianglesUseExactlyTheEdgesThatTheSurfaceCuts) {
  for (int inside = 0; inside < 256; ++inside) {
    std::set<int> used, cut;
    for (const auto& t : marching_cubes_cases()[inside]) used.insert(t.begin(), t.end());
    for (int edge = 0; edge < 12; ++edge) {
      const auto [a, b] = ends(edge);
      if ((inside >> a & 1) != (inside >> b & 1)) cut.insert(edge);
    }
    EXPECT_EQ(used, cut) << "case " << inside;
  }
}

TEST(MarchingCubes, EveryCellSurfaceIsOpenOnlyOnTheCellsFaces) {
  for (int inside = 0; inside < 256; ++inside) {
    std::multiset<std::pair<int, int>> directed;
    for (const auto& t : marching_cubes_cases()[inside]) {
      for (int k = 0; k < 3; ++k) directed.insert({t[k], t[(k + 1) % 3]});
    }
    for (const auto& [a, b] : directed) {
      EXPECT_EQ(directed.count({a, b}), 1U) << "case " << inside;
      if (directed.count({b, a}) == 1) continue;
      // An open edge lies on a face: its two cell edges have a corner plane in common.
      bool on_face = false;
      for (int bit = 0; bit < 3; ++bit) {
        for (int side = 0; side < 2; ++side) {
          const auto on = [&](int edge) {
            return (ends(edge).first >> bit & 1) == side && (ends(edge).second >> bit & 1) == side;
          };
          on_face = on_face || (on(a) && on(b));
        }
      }
      EXPECT_TRUE(on_face) << "case " << inside;
    }
  }
}

/// A ball's surface passes by the nodes at any distance.
TEST(MarchingCubes, NoEdgeIsSoShortThatNoiseTurnsItsFaces) {
  constexpr int kNodesAlong = 24;
  BlockGrid grid(Eigen::AlignedBox3f(Eigen::Vector3f::Zero(), Eigen::Vector3f::Constant(kNodesAlong)), 1.0F);
  const Eigen::Vector3f centre(11.6F, 12.3F, 11.9F);
  for (int i = 0; i < kNodesAlong * kNodesAlong * kNodesAlong; ++i) {
    const Eigen::Vector3i node(i % kNodesAlong, i / kNodesAlong % kNodesAlong, i / (kNodesAlong * kNodesAlong));
    grid.set(node, (node.cast<float>() - centre).norm() - 8.3F, 3.0F);
  }
  const Mesh surface = extract_surface(grid);
  ASSERT_GT(surface.faces.size(), 500U);
  for (const Mesh::Face& face : surface.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE((surface.vertices[face[k]] - surface.vertices[face[(k + 1) % 3]]).norm(), 0.1F);
    }
  }
}

}  // namespace
}  // namespace scanrig
