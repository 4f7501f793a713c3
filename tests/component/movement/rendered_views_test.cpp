#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <tuple>

#include "core/units.h"
#include "pipeline/movement/compare_views.h"
#include "sim/scene/figurine.h"
#include "tests/component/movement/shot_scene.h"

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

constexpr double kSettled = 0.006;  // deg: repeat accuracy of a table

/// Images of both cameras at one moment.
struct Seen {
  cv::Mat left, right;
};

Seen look(const ShotScene& scene, const Disturbance& since) {
  return {scene.look(since, true), scene.look(since, false)};
}

/// View 0 of an object, and the movement check after a change: judged as in the daemon, by both cameras.
class RenderedViews : public testing::TestWithParam<Object (*)()> {
 protected:
  ViewChange compared(const Seen& now, std::uint64_t noise, const Sensor& then = {}, const Sensor& sensor = {}) const {
    ViewChange worse;
    for (const auto& [before, after, camera] :
         {std::tuple(first_.left, now.left, 0), {first_.right, now.right, 1000}}) {
      const auto change =
          compare_views(ShotScene::shoot(before, 1 + camera, then), ShotScene::shoot(after, noise + camera, sensor));
      EXPECT_TRUE(change) << change.error().message;
      if (!change) continue;
      worse.squares = worse.squares == 0 ? change->squares : std::min(worse.squares, change->squares);
      if (change->shift_px > worse.shift_px) worse.shift_px = change->shift_px;
      worse.changed = std::max(worse.changed, change->changed);
      worse.unmoved = worse.unmoved && change->unmoved;
    }
    return worse;
  }
  void expect_found(const Disturbance& since) {
    const auto seen = look(scene_, since);
    for (std::uint64_t noise = 100; noise < 105; ++noise) {
      const auto change = compared(seen, noise);
      EXPECT_FALSE(change.unmoved) << "noise " << noise << ": " << change.shift_px << " px";
    }
  }
  void expect_unmoved(const Seen& again, int exposures, const Sensor& then = {}, const Sensor& now = {}) {
    for (std::uint64_t noise = 2; noise < 2 + static_cast<std::uint64_t>(exposures); ++noise) {
      const auto change = compared(again, noise, then, now);
      EXPECT_GE(change.squares, 8);
      EXPECT_TRUE(change.unmoved) << "noise " << noise << ": " << change.shift_px << " px, " << change.changed;
    }
  }

  const ShotScene& scene_ = before().scene;
  const Seen& first_ = before().first;

 private:
  struct Before {
    explicit Before(Object object) : scene(std::move(object), kScale) {}
    ShotScene scene;
    Seen first = look(scene, {});
  };
  /// Made once for all tests of an object.
  static const Before& before() {
    static std::map<Object (*)(), std::unique_ptr<Before>> made;
    auto& of_object = made[GetParam()];
    if (!of_object) of_object = std::make_unique<Before>(GetParam()());
    return *of_object;
  }
};

TEST_P(RenderedViews, NoiseAloneIsNoMovement) { expect_unmoved(look(scene_, {.table_deg = kSettled}), 20); }

TEST_P(RenderedViews, DimmerLightIsNoMovement) {
  expect_unmoved(look(scene_, {.table_deg = kSettled}), 3, {}, {.light = 0.95});
}

TEST_P(RenderedViews, AnObjectThatSlippedIsFound) {
  expect_found(slipped(0.2, 0.0));
  expect_found(slipped(0.0, 0.5));
}

TEST_P(RenderedViews, ATippedObjectIsFound) { expect_found(tipped(1.0)); }

TEST_P(RenderedViews, AMissingOrDisplacedObjectIsFound) {
  for (const double mm : {1.0, 5.0, 20.0}) EXPECT_FALSE(compared(look(scene_, slipped(mm, 0.0)), 2).unmoved) << mm;
  EXPECT_FALSE(compared(look(scene_, slipped(0.0, 2000.0)), 2).unmoved) << "an empty table";
}

TEST_P(RenderedViews, AKnockedCameraIsFound) {
  expect_found({.camera = small_motion({0, to_radians(0.02), 0}, {0, 0, 0})});
}

INSTANTIATE_TEST_SUITE_P(Objects, RenderedViews, testing::Values(painted_figurine, pebble),
                         [](const auto& object) { return object.index == 0 ? "Figurine" : "Pebble"; });

/// A round, even pebble looks the same from all sides: these need structure on the object.
class FigurineViews : public RenderedViews {};

TEST_P(FigurineViews, AnObjectThatTurnedAndLostStepsAreFound) {
  expect_found(turned(0.5));
  expect_found({.table_deg = 0.5});
}

TEST_P(FigurineViews, AWorseSensorIsNoMovement) {
  const auto again = look(scene_, {.table_deg = kSettled});
  for (const Sensor& sensor : {Sensor{.blur_px = 1.5}, Sensor{.noise_grey = 4}}) {
    expect_unmoved(again, 5, sensor, sensor);
  }
}

INSTANTIATE_TEST_SUITE_P(Objects, FigurineViews, testing::Values(painted_figurine));

}  // namespace
}  // namespace scanrig::sim
