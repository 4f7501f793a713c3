#include "pipeline/mesh/self_intersection.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "core/parallel.h"

namespace scanrig {
namespace {

using Faces = std::vector<std::uint32_t>;

/// Small faces anywhere in a cube of 10 mm, each with corners of its own.
Mesh loose_faces(std::size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> anywhere(0.0F, 10.0F), beside(-0.5F, 0.5F);
  Mesh mesh;
  for (std::uint32_t f = 0; f < count; ++f) {
    const Eigen::Vector3f at(anywhere(random), anywhere(random), anywhere(random));
    for (int k = 0; k < 3; ++k)
      mesh.vertices.emplace_back(at + Eigen::Vector3f(beside(random), beside(random), beside(random)));
    mesh.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return mesh;
}

/// Whether an edge of one face passes through the other.
bool passes(const Mesh& mesh, const Mesh::Face& edges, const Mesh::Face& through) {
  const auto at = [&](std::uint32_t v) { return Eigen::Vector3d(mesh.vertices[v].cast<double>()); };
  const Eigen::Vector3d corner = at(through[0]), u = at(through[1]) - corner, v = at(through[2]) - corner;
  for (std::size_t k = 0; k < 3; ++k) {
    Eigen::Matrix3d columns;
    const Eigen::Vector3d from = at(edges[k]), to = at(edges[(k + 1) % 3]);
    columns << from - to, u, v;
    const Eigen::Vector3d x = columns.partialPivLu().solve(from - corner);
    if (x[0] >= 0.0 && x[0] <= 1.0 && x[1] >= 0.0 && x[2] >= 0.0 && x[1] + x[2] <= 1.0) return true;
  }
  return false;
}

Faces by_all_pairs(const Mesh& mesh, const std::vector<bool>& is_moved) {
  const auto moved = [&](const Mesh::Face& face) {
    return is_moved.empty() || is_moved[face[0]] || is_moved[face[1]] || is_moved[face[2]];
  };
  Faces crossing;
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    for (std::uint32_t j = 0; j < mesh.faces.size(); ++j) {
      const Mesh::Face &a = mesh.faces[i], &b = mesh.faces[j];
      if (i == j || !(moved(a) || moved(b)) || !(passes(mesh, a, b) || passes(mesh, b, a))) continue;
      crossing.push_back(i);
      break;
    }
  }
  return crossing;
}

TEST(SelfIntersection, FindsWhatAllPairsShow) {
  const Mesh mesh = loose_faces(1500);
  const Faces expected = by_all_pairs(mesh, {});
  ASSERT_GT(expected.size(), 100U);
  ASSERT_LT(expected.size(), 1400U) << "else this test shows nothing";
  EXPECT_EQ(self_intersecting_faces(mesh), expected);
}

TEST(SelfIntersection, AsksOnlyAboutMovedCorners) {
  const Mesh mesh = loose_faces(1500);
  std::vector<bool> is_moved(mesh.vertices.size(), false);
  for (std::size_t v = 0; v < is_moved.size(); v += 40) is_moved[v] = true;
  const Faces expected = by_all_pairs(mesh, is_moved);
  ASSERT_GT(expected.size(), 10U);
  ASSERT_LT(expected.size(), by_all_pairs(mesh, {}).size());
  EXPECT_EQ(self_intersecting_faces(mesh, is_moved), expected);
}

TEST(SelfIntersection, NeighboursAndEmptyMeshesDoNotCross) {
  EXPECT_TRUE(self_intersecting_faces({}).empty());
  Mesh fan;
  fan.vertices = {{0.0F, 0.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {1.0F, 1.0F, 0.0F}, {0.2F, 0.2F, 1.0F}};
  fan.faces = {{0, 1, 2}, {1, 3, 2}, {0, 1, 4}};
  EXPECT_TRUE(self_intersecting_faces(fan).empty());
}

}  // namespace
}  // namespace scanrig
