#include "pipeline/volume/integrate.h"

#include <gtest/gtest.h>

#include "pipeline/mesh/solid.h"
#include "pipeline/mesh/topology.h"
#include "tests/unit/pipeline/volume/analytic_rig.h"

namespace scanrig {
namespace {

using namespace test;

TEST(Integrate, SphereOnTheTableBecomesOneClosedSurfaceOnItsTrueSurface) {
  const Solid solid = sphere({0, 30, 0}, 30);
  const auto views = take_views({}, cast_into(solid));
  const PosedViews pose{views};
  const auto surface = integrate({&pose, 1}, {.voxel_mm = 0.5});
  ASSERT_TRUE(surface) << surface.error().message;
  const Topology shape = topology(surface->mesh);
  EXPECT_TRUE(shape.watertight());
  EXPECT_EQ(shape.components, 1U);
  EXPECT_EQ(shape.genus(), 0);
  const Accuracy a = accuracy(surface->mesh, solid);
  EXPECT_LE(a.median, 0.005);
  auto sp=solid_properties(surface->mesh); printf("vol %g (%g)\n", sp?sp->volume_mm3:-1, 4./3*3.14159265*27000); printf("%g %g %g share %g closed %g\n", a.median,a.p95,a.greatest,a.measured_share,a.greatest_closed);
}

}  // namespace
}  // namespace scanrig
