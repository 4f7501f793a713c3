#include "pipeline/mesh/surface_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "tests/unit/pipeline/mesh/ball_mesh.h"

namespace scanrig {
namespace {

using namespace ball_mesh;

TEST(SurfaceIndex, NearestAgreesWithTheBall) {
  const auto index = SurfaceIndex::create(ball());
  ASSERT_TRUE(index);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-40.0, 40.0);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d off(coordinate(random), coordinate(random), coordinate(random));
    const auto nearest = index->nearest(kCentre + off);
    EXPECT_NEAR(nearest.distance, std::abs(off.norm() - kRadius), 0.01);
    EXPECT_NEAR((nearest.point - kCentre - off).norm(), nearest.distance, 1e-9);
  }
}

TEST(SurfaceIndex, NearestOfATriangleIsTheBestOfManyOfItsPoints) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  const auto any = [&] { return Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random)); };
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p = 2.0 * any(), a = any(), b = any(), c = any();
    double best = 1e9;
    for (int u = 0; u <= 200; ++u) {
      for (int v = 0; u + v <= 200; ++v) {
        best = std::min(best, (a + (b - a) * (u / 200.0) + (c - a) * (v / 200.0) - p).norm());
      }
    }
    const double found = (nearest_on_triangle(p, a, b, c) - p).norm();
    EXPECT_LE(found, best + 1e-12);
    EXPECT_GE(found, best - 0.02);
  }
}

TEST(SurfaceIndex, NothingWithinTheLimitIsInfinitelyFar) {
  const auto index = SurfaceIndex::create(ball());
  EXPECT_TRUE(std::isinf(index->nearest(kCentre, 20.0).distance));
  EXPECT_LT(index->nearest(kCentre, 26.0).distance, 25.1);
}

TEST(SurfaceIndex, RaysHitAndSegmentsAreBlockedOnlyByFacesBetween) {
  const auto index = SurfaceIndex::create(ball());
  const Eigen::Vector3d outside = kCentre + Eigen::Vector3d(100.0, 1.0, 2.0);
  const auto hit = index->first_hit(outside, Eigen::Vector3d(-2.0, 0.0, 0.0));
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 37.55, 0.02);
  const Mesh mesh = ball();
  Eigen::Vector3d there = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) there += hit->weights[k] * mesh.vertices[mesh.faces[hit->face][k]].cast<double>();
  EXPECT_NEAR((there - outside).norm(), 2.0 * hit->distance, 1e-3) << "the weights name the point";
  EXPECT_FALSE(index->first_hit(outside, Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(index->blocked(outside, kCentre));
  EXPECT_FALSE(index->blocked(outside, kCentre + Eigen::Vector3d(30.0, 0.0, 0.0)));
}

TEST(SurfaceIndex, ASelectionKeepsTheMeshsNumbers) {
  const Mesh mesh = ball();
  const std::vector<std::uint32_t> selected{7, 1000};
  const auto index = SurfaceIndex::create(mesh, selected);
  const Eigen::Vector3d corner = mesh.vertices[mesh.faces[1000][1]].cast<double>();
  EXPECT_EQ(index->nearest(corner).face, 1000u);
  std::set<std::uint32_t> near;
  index->near(corner, 1.0, [&near](std::uint32_t face) { near.insert(face); });
  EXPECT_TRUE(near.contains(1000));
  EXPECT_TRUE(std::includes(std::begin(selected), std::end(selected), near.begin(), near.end()));
  EXPECT_EQ(SurfaceIndex::create(mesh, {}).error().code, ErrorCode::degenerate);
}

}  // namespace
}  // namespace scanrig
