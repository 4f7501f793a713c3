#include <gtest/gtest.h>

#include "core/units.h"
#include "pipeline/closure/compare_views.h"
#include "sim/scene/figurine.h"
#include "tests/component/closure/shot_scene.h"

namespace scanrig::sim {
namespace {

constexpr double kScale = 0.25;  // 320 x 240 pixels

Object painted_figurine() {
  Object object;
  object.name = "figurine";
  object.mesh = figurine(1.0);
  object.normals = vertex_normals(object.mesh);
  object.colour = painted_colour();
  return object;
}

Disturbance slipped(double x_mm, double z_mm) { return {.object = small_motion({0, 0, 0}, {x_mm, 0, z_mm})}; }
Disturbance tipped(double degrees) { return {.object = small_motion({to_radians(degrees), 0, 0}, {0, 0, 0})}; }
Disturbance turned(double degrees) { return {.object = small_motion({0, to_radians(degrees), 0}, {0, 0, 0})}; }

/// View 0 of an object, and what the closure shot says of it after something has happened.
class RenderedViews : public testing::TestWithParam<Object (*)()> {
 protected:
  ViewChange after(const Disturbance& since, std::uint64_t noise = 2, const Sensor& now = {}) {
    const auto change = compare_views(ShotScene::shoot(first_, 1), ShotScene::shoot(scene_.look(since), noise, now));
    EXPECT_TRUE(change) << change.error().message;
    return change.value_or(ViewChange{});
  }
  void expect_found(const Disturbance& since) {
    const auto seen = scene_.look(since);
    for (std::uint64_t noise = 100; noise < 105; ++noise) {
      const auto change = compare_views(ShotScene::shoot(first_, 1), ShotScene::shoot(seen, noise));
      ASSERT_TRUE(change) << change.error().message;
      EXPECT_FALSE(change->unmoved) << "noise " << noise << ": " << change->shift_px << " px";
    }
  }

  ShotScene scene_{GetParam()(), kScale};
  cv::Mat first_ = scene_.look({});
};

TEST_P(RenderedViews, WhereNothingMovedNoNoiseSaysSo) {
  const cv::Mat before = ShotScene::shoot(first_, 1), again = scene_.look({.table_deg = 0.006});
  for (std::uint64_t noise = 2; noise < 22; ++noise) {
    const auto change = compare_views(before, ShotScene::shoot(again, noise));
    ASSERT_TRUE(change) << change.error().message;
    EXPECT_TRUE(change->unmoved) << "noise " << noise << ": " << change->shift_px << " px, " << change->changed;
    EXPECT_GE(change->squares, 8);
  }
}

TEST_P(RenderedViews, LightThatBecameDimmerIsNoMovement) {
  const auto change = after({}, 2, {.light = 0.95});
  EXPECT_TRUE(change.unmoved) << change.shift_px << " px, " << change.changed;
}

TEST_P(RenderedViews, AnObjectThatSlippedIsFound) {
  expect_found(slipped(0.2, 0.0));
  expect_found(slipped(0.0, 0.5));
}

TEST_P(RenderedViews, ATippedObjectIsFound) { expect_found(tipped(1.0)); }

TEST_P(RenderedViews, AnObjectThatIsGoneOrElsewhereIsFound) {
  for (const double mm : {1.0, 5.0, 20.0}) EXPECT_FALSE(after(slipped(mm, 0.0)).unmoved) << mm;
  EXPECT_FALSE(after(slipped(0.0, 2000.0)).unmoved) << "an empty table";
}

TEST_P(RenderedViews, AKnockedCameraIsFound) {
  expect_found({.camera = small_motion({0, to_radians(0.02), 0}, {0, 0, 0})});
}

INSTANTIATE_TEST_SUITE_P(Objects, RenderedViews, testing::Values(painted_figurine, pebble),
                         [](const auto& object) { return object.index == 0 ? "Figurine" : "Pebble"; });

/// A round, even pebble looks the same from all sides: these need something on the object.
class FigurineViews : public RenderedViews {};

TEST_P(FigurineViews, AnObjectThatTurnedAndLostStepsAreFound) {
  expect_found(turned(0.5));
  expect_found({.table_deg = 0.5});
}

TEST_P(FigurineViews, AWorseSensorIsNoMovement) {
  for (const Sensor& sensor : {Sensor{.blur_px = 1.5}, Sensor{.noise_grey = 4}}) {
    const cv::Mat before = ShotScene::shoot(first_, 1, sensor), again = scene_.look({});
    for (std::uint64_t noise = 2; noise < 7; ++noise) {
      const auto change = compare_views(before, ShotScene::shoot(again, noise, sensor));
      ASSERT_TRUE(change) << change.error().message;
      EXPECT_TRUE(change->unmoved) << change->shift_px << " px, " << change->changed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Objects, FigurineViews, testing::Values(painted_figurine));

}  // namespace
}  // namespace scanrig::sim
