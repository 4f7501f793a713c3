#include "pipeline/pose/convex_hull.h"

#include <gtest/gtest.h>

#include <random>

#include "pipeline/mesh/solid_properties.h"
#include "tests/unit/pipeline/pose/solid_mesh.h"

namespace scanrig {
namespace {

TEST(SolidProperties, CentreOfMassIsThatOfTheSolidNotOfItsVertices) {
  Mesh box = testing::box_mesh({0, 0, 0}, {10, 20, 40});
  const Mesh::Face split = box.faces.back();  // a crowd of vertices in one face changes nothing
  box.faces.pop_back();
  Eigen::Vector3f inside = box.vertices[split[0]];
  std::uint32_t apex = split[0];
  for (int k = 0; k < 50; ++k) {
    inside = (inside + 0.02F * (box.vertices[split[1]] - inside) + 0.02F * (box.vertices[split[2]] - inside)).eval();
    const auto next = static_cast<std::uint32_t>(box.vertices.size());
    box.vertices.push_back(inside);
    box.faces.push_back({apex, split[1], next});
    box.faces.push_back({split[2], apex, next});
    apex = next;
  }
  box.faces.push_back({apex, split[1], split[2]});
  const auto properties = solid_properties(box);
  ASSERT_TRUE(properties) << properties.error().message;
  EXPECT_NEAR(properties->volume_mm3, 8000.0, 0.1);
  EXPECT_LT((properties->centre_of_mass - Eigen::Vector3d(5, 10, 20)).norm(), 1e-3);
}

TEST(SolidProperties, ReportsAMeshThatIsNotClosed) {
  Mesh box = testing::box_mesh({0, 0, 0}, {10, 20, 40});
  box.faces.pop_back();
  const auto properties = solid_properties(box);
  ASSERT_FALSE(properties);
  EXPECT_EQ(properties.error().code, ErrorCode::not_closed);
}

TEST(SolidProperties, ReportsAMeshInsideOut) {
  Mesh box = testing::box_mesh({0, 0, 0}, {10, 20, 40});
  for (auto& face : box.faces) std::swap(face[0], face[1]);
  const auto properties = solid_properties(box);
  ASSERT_FALSE(properties);
  EXPECT_EQ(properties.error().code, ErrorCode::degenerate);
}

TEST(ConvexHull, OfManyPointsInABallIsTheBall) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.0F, 1.0F);
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 20000; ++k) {
    const Eigen::Vector3f direction = Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    points.push_back(direction * (k % 3 == 0 ? 30.0F : 20.0F));
  }
  const auto hull = convex_hull(points);
  ASSERT_TRUE(hull) << hull.error().message;
  const auto properties = solid_properties(*hull);  // closed, and facing outward
  ASSERT_TRUE(properties) << properties.error().message;
  EXPECT_NEAR(properties->volume_mm3 / (4.0 / 3.0 * std::numbers::pi * 27000.0), 1.0, 0.01);
  EXPECT_LE(hull->vertices.size(), 6667u);
}

TEST(ConvexHull, ReportsFlatPoints) {
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 100; ++k) points.emplace_back(k % 10, 0, k / 10);
  const auto hull = convex_hull(points);
  ASSERT_FALSE(hull);
  EXPECT_EQ(hull.error().code, ErrorCode::degenerate);
}

}  // namespace
}  // namespace scanrig
