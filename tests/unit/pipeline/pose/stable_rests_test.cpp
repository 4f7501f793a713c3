#include "pipeline/pose/stable_rests.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/pipeline/pose/solid_mesh.h"

namespace scanrig {
namespace {

using FindRests = Result<StableRests> (*)(const Mesh&, const SolidProperties&, double, const StableRestOptions&);

class RestsEitherWay : public ::testing::TestWithParam<FindRests> {
 protected:
  static StableRests find(const Mesh& solid, double other_height, FindRests how) {
    const auto properties = solid_properties(solid);
    EXPECT_TRUE(properties);
    const auto found = how(solid, *properties, other_height, {});
    EXPECT_TRUE(found) << (found ? "" : found.error().message);
    return found.value_or(StableRests{});
  }
  static const StableRest* along(const StableRests& found, const Eigen::Vector3d& normal) {
    const auto it =
        std::ranges::find_if(found.rests, [&](const auto& rest) { return rest.normal.dot(normal) > 0.999; });
    return it == found.rests.end() ? nullptr : &*it;
  }
};

TEST_P(RestsEitherWay, ABoxStandsOnEachOfItsFaces) {
  const Mesh box = testing::box_mesh({0, 0, 0}, {30, 30, 30});
  const auto found = find(box, 30, GetParam());
  ASSERT_EQ(found.rests.size(), 6u);
  for (const auto& rest : found.rests) {
    EXPECT_NEAR(rest.normal.cwiseAbs().maxCoeff(), 1.0, 1e-6);
    EXPECT_NEAR(rest.height_mm, 30.0, 1e-4);
    EXPECT_NEAR(rest.margin_mm, 15.0, 1e-3);
  }
}

TEST_P(RestsEitherWay, ALeaningPrismFallsOverWhereItsCentreOfMassIsBesideTheFace) {
  Mesh prism = testing::box_mesh({0, 0, 0}, {20, 40, 20});
  for (auto& v : prism.vertices) v.x() += v.y();  // leans by 45 deg: the centre is 10 mm beside the lower face
  const auto found = find(prism, 20, GetParam());
  EXPECT_EQ(along(found, -Eigen::Vector3d::UnitY()), nullptr);
  EXPECT_NE(along(found, Eigen::Vector3d::UnitZ()), nullptr);
}

TEST_P(RestsEitherWay, TheOffsetTouchesTheSolidAndNothingLiesBeyond) {
  const Mesh solid = testing::mesh_of(testing::workpiece(), {-34, -3, -24}, {35, 66, 36}, 2.0);
  const auto properties = solid_properties(solid);
  ASSERT_TRUE(properties) << properties.error().message;
  const auto found = find(solid, 60, GetParam());
  for (const auto& rest : found.rests) EXPECT_NEAR(rest.offset_mm, reach_along(solid.vertices, rest.normal), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(HullAndSphere, RestsEitherWay, ::testing::Values(&rests_on_hull, &rests_on_sphere),
                         [](const auto& way) { return way.param == &rests_on_hull ? "Hull" : "Sphere"; });

TEST(RestsOnHull, KeepsTheRestsOfAWorkPieceThatItsFacesShow) {
  const Mesh solid = testing::mesh_of(testing::workpiece(), {-34, -3, -24}, {35, 66, 36}, 2.0);
  const auto properties = solid_properties(solid);
  ASSERT_TRUE(properties) << properties.error().message;
  const auto found = rests_on_hull(solid, *properties, 60, {});
  ASSERT_TRUE(found) << found.error().message;
  for (const int axis : {0, 1, 2}) {
    const Eigen::Vector3d side = -Eigen::Vector3d::Unit(axis);
    const bool there = std::ranges::any_of(
        found->rests, [&](const StableRest& rest) { return rest.normal.dot(side) > std::cos(to_radians(2)); });
    EXPECT_TRUE(there) << side.transpose();
  }
}

TEST(RestsOnSphere, CountsThePlanesLeftByEachTestOfThePaper) {
  const Mesh solid = testing::mesh_of(testing::workpiece(), {-34, -3, -24}, {35, 66, 36}, 2.0);
  const auto properties = solid_properties(solid);
  ASSERT_TRUE(properties) << properties.error().message;
  const auto found = rests_on_sphere(solid, *properties, 62, {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(found->counts.tangent_planes, found->counts.after_base_plane);  // the steps of the work piece face nothing
  EXPECT_GT(found->counts.after_base_plane, found->counts.after_stability);
  EXPECT_GT(found->counts.after_stability, found->counts.after_height);
  EXPECT_GE(found->counts.after_height, 1);
  EXPECT_EQ(found->counts.after_height, static_cast<int>(found->rests.size()));
}

TEST(SupportMargin, IsNegativeBesideTheSupports) {
  const std::vector<Eigen::Vector3d> feet = {{0, 0, 0}, {10, 0, 0}, {10, 0, 10}, {0, 0, 10}};
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitY();
  EXPECT_NEAR(support_margin(feet, down, {5, 50, 4}), 4.0, 1e-12);
  EXPECT_NEAR(support_margin(feet, down, {13, 50, 5}), -3.0, 1e-12);
  EXPECT_NEAR(support_margin({{feet[0]}}, down, {3, 50, 4}), -5.0, 1e-12);
}

}  // namespace
}  // namespace scanrig
