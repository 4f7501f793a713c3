#include "pipeline/pose/fixtures.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "tests/unit/pipeline/pose/held_solids.h"
#include "tests/unit/pipeline/pose/posed_scan.h"

namespace scanrig {
namespace {

using testing::held;
using testing::HeldPose;
using testing::Holder;
using testing::kPoseRig;

const Eigen::Matrix3d kLeaning = testing::turn(25, {1, 0, -0.5}), kTurnedOver = testing::turn(150, {1, 0.2, 0.3});

struct HeldScan {
  std::vector<HeldPose> poses;
  std::vector<std::vector<View>> views;

  [[nodiscard]] std::vector<PlacedPose> placed() const {
    std::vector<PlacedPose> all;
    for (std::size_t p = 0; p < poses.size(); ++p) {
      all.push_back({views[p], poses[0].pose_from_object * poses[p].pose_from_object.inverse()});
    }
    return all;
  }
};

HeldScan held_scan(Holder first, Holder second) {
  HeldScan scan;
  const testing::Solid solid = testing::workpiece();
  scan.poses = {held(solid, kLeaning, first, first == Holder::none ? 0.0 : 8.0),
                held(solid, kTurnedOver, second, second == Holder::none ? 0.0 : 7.0)};
  for (const HeldPose& pose : scan.poses) {
    const auto seed = static_cast<unsigned>(scan.views.size()) + 1;
    scan.views.push_back(testing::turn_around(testing::bounded(pose.all(), {0, 35, 0}, 75), 8, kPoseRig, seed));
  }
  return scan;
}

const HeldScan& on_putty() {
  static const HeldScan scan = held_scan(Holder::putty, Holder::none);
  return scan;
}

std::size_t measured_pixels(const RangeImage& range) {
  return static_cast<std::size_t>(cv::countNonZero(range.depth == range.depth));
}

TEST(Fixtures, IsWhatOnePoseMeasuredAndTheOtherLookedThrough) {
  const auto found = find_fixtures(on_putty().placed());
  ASSERT_EQ(found.size(), 2U);
  ASSERT_TRUE(found[0]);
  EXPECT_FALSE(found[1]);
  EXPECT_NEAR(found[0]->height_mm, 14.0, 2.5);
  EXPECT_GT(found[0]->area_mm2, 300.0);
  EXPECT_LT(found[0]->area_mm2, 1200.0);
  const testing::Solid& putty = on_putty().poses[0].fixture;
  EXPECT_LT(std::abs(putty(found[0]->centre)), 13.0);
}

TEST(Fixtures, RemovingOneLeavesTheObjectAndNoBackground) {
  const HeldScan& scan = on_putty();
  const auto found = find_fixtures(scan.placed());
  ASSERT_TRUE(found[0]);
  std::size_t of_putty = 0, of_object = 0, object_before = 0;
  for (const View& view : scan.views[0]) {
    RangeImage range = view.range;
    const std::size_t before = measured_pixels(view.range);
    const auto removed = remove_fixture(*found[0], range);
    EXPECT_EQ(removed.size(), measured_pixels(view.range) - measured_pixels(range));
    EXPECT_EQ(measured_pixels(view.range), before) << "the view shares its pixels";
    EXPECT_LT(measured_pixels(range), before);
    EXPECT_EQ(cv::countNonZero(range.background != view.range.background), 0);
    const Transform pose_from_camera = range.camera_from_pose.inverse();
    for (int v = 0; v < range.depth.rows; ++v) {
      for (int u = 0; u < range.depth.cols; ++u) {
        const float depth = view.range.depth(v, u);
        if (std::isnan(depth)) continue;
        const Eigen::Vector3d point = pose_from_camera * range.projection.unproject(u, v, depth);
        const bool is_kept = !std::isnan(range.depth(v, u));
        const bool is_object = scan.poses[0].object(point) < 0.1;
        object_before += is_object ? 1 : 0;
        of_object += is_object && is_kept ? 1 : 0;
        of_putty += !is_object && is_kept && scan.poses[0].object(point) > 0.5 ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(of_putty, 0U);
  EXPECT_GT(static_cast<double>(of_object), 0.97 * static_cast<double>(object_before));
}

TEST(Fixtures, ThreePinsAreOneFixture) {
  const auto found = find_fixtures(held_scan(Holder::pins, Holder::pins).placed());
  for (const auto& fixture : found) {
    ASSERT_TRUE(fixture);
    EXPECT_GT(fixture->area_mm2, 80.0);
    EXPECT_GT(fixture->height_mm, 6.0);
  }
}

/// It meets a leaning side far up.
TEST(Fixtures, APinMayBeHigherThanHalfOfTheObject) {
  HeldScan scan = on_putty();
  constexpr double kHigh = 45.0;
  const testing::Solid with_pin =
      testing::together({scan.poses[0].all(), testing::upright_cylinder({0, 0, 34}, 3, kHigh)});
  scan.views[0] = testing::turn_around(testing::bounded(with_pin, {0, 35, 0}, 75), 8, kPoseRig, 1);
  const auto found = find_fixtures(scan.placed());
  ASSERT_TRUE(found[0]);
  EXPECT_NEAR(found[0]->height_mm, kHigh, 3.0);
}

TEST(Fixtures, AreNoneUnderAnObjectOnTheTable) {
  for (const auto& fixture : find_fixtures(held_scan(Holder::none, Holder::none).placed())) EXPECT_FALSE(fixture);
}

/// Surface that is gone, but hangs in the air: something else is wrong.
TEST(Fixtures, BeginAtTheTable) {
  HeldScan scan = on_putty();
  const testing::Solid above = testing::together({scan.poses[0].object, testing::ball({0, 100, 0}, 8)});
  scan.views[0] = testing::turn_around(above, 8, kPoseRig, 1);
  EXPECT_FALSE(find_fixtures(scan.placed())[0]);
}

TEST(Fixtures, PosesThatAreLeftOutNeitherHaveNorShowThem) {
  auto placed = on_putty().placed();
  placed[1].model_from_pose.reset();
  for (const auto& fixture : find_fixtures(placed)) EXPECT_FALSE(fixture);
}

TEST(Fixtures, AreTheSameOnAnyNumberOfThreads) {
  std::vector<std::optional<Fixture>> one, many;
  with_threads(1, [&] { one = find_fixtures(on_putty().placed()); });
  with_threads(3, [&] { many = find_fixtures(on_putty().placed()); });
  ASSERT_TRUE(one[0] && many[0]);
  EXPECT_EQ(one[0]->cells, many[0]->cells);
  EXPECT_EQ(one[0]->area_mm2, many[0]->area_mm2);
  EXPECT_EQ(one[0]->centre, many[0]->centre);
}

}  // namespace
}  // namespace scanrig
