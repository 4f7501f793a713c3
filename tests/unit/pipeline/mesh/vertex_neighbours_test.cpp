#include "pipeline/mesh/vertex_neighbours.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scanrig {
namespace {

/// A flat sheet of squares, each cut along the same diagonal; row by row.
Mesh sheet(std::uint32_t side) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < side * side; ++i) {
    const std::uint32_t row = i / side, column = i % side;
    mesh.vertices.emplace_back(static_cast<float>(column), 0.0F, static_cast<float>(row));
  }
  for (std::uint32_t row = 0; row + 1 < side; ++row) {
    for (std::uint32_t column = 0; column + 1 < side; ++column) {
      const std::uint32_t at = row * side + column;
      mesh.faces.push_back({at, at + side, at + 1});
      mesh.faces.push_back({at + 1, at + side, at + side + 1});
    }
  }
  return mesh;
}

std::vector<std::uint32_t> of(const VertexNeighbours& around, std::size_t vertex) {
  return {around.of(vertex).begin(), around.of(vertex).end()};
}

TEST(VertexNeighbours, AreThoseThatShareAnEdgeEachOnce) {
  const VertexNeighbours around(sheet(3));
  EXPECT_EQ(of(around, 4), (std::vector<std::uint32_t>{1, 2, 3, 5, 6, 7}));
  EXPECT_EQ(of(around, 0), (std::vector<std::uint32_t>{1, 3})) << "at the rim too, where an edge has one face";
  EXPECT_EQ(of(around, 2), (std::vector<std::uint32_t>{1, 4, 5}));
}

TEST(VertexNeighbours, AVertexWithoutFacesHasNone) {
  Mesh mesh = sheet(2);
  mesh.vertices.emplace_back(9.0F, 0.0F, 9.0F);
  const VertexNeighbours around(mesh);
  EXPECT_TRUE(around.of(4).empty());
  EXPECT_EQ(around.smoothed(std::vector<float>{1, 1, 1, 1, 7}, 3)[4], 7.0F);
}

TEST(VertexNeighbours, RoundsOfMeansAreAGaussian) {
  constexpr std::uint32_t kSide = 41, kMiddle = kSide / 2;
  constexpr int kRounds = 12;
  const Mesh mesh = sheet(kSide);
  std::vector<float> peak(mesh.vertices.size(), 0.0F);
  peak[peak.size() / 2] = 1.0F;
  const std::vector<float> spread = VertexNeighbours(mesh).smoothed(peak, kRounds);
  double sum = 0.0, square = 0.0;
  for (std::size_t v = 0; v < spread.size(); ++v) {
    const double off = static_cast<double>(mesh.vertices[v].x()) - kMiddle;
    sum += static_cast<double>(spread[v]);
    square += static_cast<double>(spread[v]) * off * off;
  }
  EXPECT_NEAR(sum, 1.0, 1e-5);
  // Of the six neighbours two lie in the row, two in the column, two on the diagonal: four of seven are 1 away in x.
  EXPECT_NEAR(square, kRounds * 4.0 / 7.0, 1e-3);
}

}  // namespace
}  // namespace scanrig
