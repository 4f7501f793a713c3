#include "sim/scene/figurine.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numeric>

#include "sim/scene/polygonise.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

int components(const TriangleMesh& mesh) {
  std::vector<int> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  int count = static_cast<int>(parent.size());
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 2; ++i) {
      const int a = root(t[i]), b = root(t[i + 1]);
      if (a != b) parent[a] = b, --count;
    }
  }
  return count;
}

/// Of a closed mesh in one piece.
int genus(const TriangleMesh& mesh) {
  const auto v = static_cast<int>(mesh.vertices.size()), f = static_cast<int>(mesh.triangles.size());
  return (2 - (v - 3 * f / 2 + f)) / 2;
}

const TriangleMesh& the_figurine() {
  static const TriangleMesh mesh = figurine();
  return mesh;
}

TEST(Figurine, IsOneClosedSurfaceOfGenusZero) {
  EXPECT_TRUE(is_closed(the_figurine()));
  EXPECT_EQ(components(the_figurine()), 1);
  EXPECT_EQ(genus(the_figurine()), 0);
  EXPECT_GT(volume(the_figurine()), 0.0);
}

TEST(Figurine, FitsTheWorkingVolume) {
  Eigen::AlignedBox3d box;
  std::vector<Vector2d> plan;
  for (const auto& v : the_figurine().vertices) box.extend(v), plan.emplace_back(v.x(), v.z());
  EXPECT_NEAR(box.min().y(), 0.0, 1e-9);
  EXPECT_NEAR(box.max().y(), 100.0, 1e-9);
  EXPECT_LE(2.0 * smallest_circle(plan).radius, 115.0);
}

TEST(Figurine, LooksDifferentAfterAnyHalfTurnOrReflection) {
  // The second and third moments of the volume's surface: a symmetry would make these vanish about its axis or plane.
  const Vector3d centre = centre_of_mass(the_figurine());
  Vector3d skew = Vector3d::Zero();
  for (const auto& v : the_figurine().vertices) skew += (v - centre).array().cube().matrix();
  skew /= static_cast<double>(the_figurine().vertices.size());
  for (const double s : skew) EXPECT_GT(std::cbrt(std::abs(s)), 5.0);
}

TEST(Figurine, HasAHollowUnderside) {
  // Straight below the middle the lowest surface is not the table's plane but the roof of a cavity.
  double lowest = 1e9;
  for (const auto& v : the_figurine().vertices) {
    if (std::hypot(v.x() - 3.0, v.z()) < 3.0) lowest = std::min(lowest, v.y());
  }
  EXPECT_GT(lowest, 8.0);
}

TEST(Polygonise, MakesASphereOfTheRightSize) {
  constexpr double kRadius = 10.0;
  const auto field = [](const Vector3d& p) { return p.norm() - kRadius; };
  const auto mesh = polygonise(field, {Vector3d::Constant(-12.3), Vector3d::Constant(12.3)}, 0.5, 1.0);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(genus(mesh), 0);
  for (const auto& v : mesh.vertices) ASSERT_NEAR(v.norm(), kRadius, 1e-6);
  EXPECT_NEAR(volume(mesh), 4.0 / 3.0 * M_PI * 1000.0, 15.0);
}

TEST(Polygonise, KeepsTheHoleOfATorus) {
  const auto field = [](const Vector3d& p) { return std::hypot(std::hypot(p.x(), p.z()) - 8.0, p.y()) - 2.5; };
  const auto mesh = polygonise(field, {Vector3d::Constant(-12.3), Vector3d::Constant(12.3)}, 0.5, 1.0);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(genus(mesh), 1);
}

}  // namespace
}  // namespace scanrig::sim
