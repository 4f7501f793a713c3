#include "sim/scene/fixture.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/units.h"
#include "tests/unit/sim/scene/shapes.h"

namespace scanrig::sim {
namespace {

using Eigen::Vector3d;

const Vector3d kHalf(30.0, 20.0, 10.0);

Transform on_the_table() { return Transform(Eigen::Translation3d(0.0, kHalf.y(), 0.0)); }

HeldObject held(FixtureKind kind, std::uint64_t seed) {
  const TriangleMesh mesh = box(kHalf);
  const RayCaster rays(mesh);
  auto found = hold(mesh, rays, on_the_table(), kind, seed);
  EXPECT_TRUE(found);
  return *found;
}

class HeldBox : public testing::TestWithParam<FixtureKind> {};

TEST_P(HeldBox, LeansAboveTheTableOnAClosedFixture) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const HeldObject object = held(GetParam(), seed);
    const double cosine = (object.table_from_object.linear() * Vector3d::UnitY()).y();
    EXPECT_GT(to_degrees(std::acos(cosine)), 7.9);
    EXPECT_LT(to_degrees(std::acos(cosine)), 25.1);
    double lowest = 1e9, fixture_low = 1e9, fixture_top = 0.0;
    for (const Vector3d& v : box(kHalf).vertices) lowest = std::min(lowest, (object.table_from_object * v).y());
    for (const Vector3d& v : object.fixture.vertices) {
      const double y = (object.table_from_object * v).y();
      fixture_low = std::min(fixture_low, y);
      fixture_top = std::max(fixture_top, y);
    }
    EXPECT_NEAR(lowest, 8.0, 1e-9);
    EXPECT_NEAR(fixture_low, 0.0, 1e-9);
    EXPECT_GT(fixture_top, lowest);
    EXPECT_TRUE(is_closed(object.fixture));
    EXPECT_GT(volume(object.fixture), 0.0);
  }
}

TEST_P(HeldBox, IsTheSameForTheSameSeed) {
  const HeldObject a = held(GetParam(), 7), b = held(GetParam(), 7), c = held(GetParam(), 8);
  EXPECT_EQ(a.table_from_object.matrix(), b.table_from_object.matrix());
  EXPECT_EQ(a.fixture.vertices, b.fixture.vertices);
  EXPECT_NE(a.table_from_object.matrix(), c.table_from_object.matrix());
}

INSTANTIATE_TEST_SUITE_P(Fixtures, HeldBox, testing::Values(FixtureKind::putty, FixtureKind::pins));

TEST(Fixture, NoneLeavesThePlacement) {
  const HeldObject object = held(FixtureKind::none, 1);
  EXPECT_EQ(object.table_from_object.matrix(), on_the_table().matrix());
  EXPECT_TRUE(object.fixture.triangles.empty());
}

TEST(Fixture, IsSeenWithTheObjectAndHasAColourOfItsOwn) {
  Object object;
  object.mesh = box(kHalf);
  object.normals = vertex_normals(object.mesh);
  object.colour =
      vertex_colour(std::vector<Eigen::Vector3f>(object.mesh.vertices.size(), Eigen::Vector3f(0.5F, 0.1F, 0.1F)),
                    object.mesh.triangles);
  const HeldObject put = held(FixtureKind::putty, 1);
  const Object both = with_fixture(object, put.fixture);
  EXPECT_EQ(both.mesh.triangles.size(), object.mesh.triangles.size() + put.fixture.triangles.size());
  EXPECT_EQ(both.normals.size(), both.mesh.vertices.size());
  EXPECT_TRUE(is_closed(both.mesh));
  SurfacePoint point;
  const auto of_object = both.colour->albedo(point);
  point.triangle = static_cast<int>(object.mesh.triangles.size());
  EXPECT_NE(both.colour->albedo(point), of_object);
}

}  // namespace
}  // namespace scanrig::sim
