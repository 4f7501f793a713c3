// How a board stands, against its plan: on images that share no code with the product.
#include "pipeline/calibration/placement/placement_aid.h"

#include <gmock/gmock.h>

#include "core/units.h"
#include "tests/unit/pipeline/calibration/board_renderer.h"

namespace scanrig {
namespace {

using testing::BoardPlace;
using ::testing::HasSubstr;

/// The renderer's camera, without its distortion, on both sides.
class Aid : public ::testing::Test {
 protected:
  Aid() {
    for (double& k : lens_.distortion) k = 0.0;
    Camera camera;
    camera.projection = {
        .width = lens_.width, .height = lens_.height, .fx = lens_.f, .fy = lens_.f, .cx = lens_.cx, .cy = lens_.cy};
    camera.camera_from_turntable = testing::camera_from_table();
    rig_.left = rig_.right = camera;
  }
  cv::Mat shoot(const BoardPlace& place) const {
    return testing::render(testing::make_print({}), lens_, testing::camera_from_board(place), {});
  }
  PlacementView compare(const cv::Mat& image, std::optional<double> table_deg = 0.0) const {
    return compare_placement(image, image, "BayerRG8", board_, calibration_plan()[0], &rig_, table_deg);
  }
  /// Where the first placement's board has its middle.
  Eigen::Vector3d planned_middle() const {
    return planned_table_from_board(calibration_plan()[0], board_).translation();
  }

  testing::TestCamera lens_;
  Board board_;
  Calibration rig_;
};

TEST_F(Aid, ABoardAsPlannedIsAccepted) {
  const auto view = compare(shoot({.tilt_deg = 60.0, .centre = planned_middle()}));
  ASSERT_TRUE(view.left.is_seen && view.off_deg && view.off_mm);
  EXPECT_LT(*view.off_deg, 0.5);
  EXPECT_LT(*view.off_mm, 0.5);
  EXPECT_TRUE(view.is_accepted());
  ASSERT_EQ(view.left.expected.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((view.left.expected[i] - view.left.outline[i]).norm(), 2.0) << i;
}

TEST_F(Aid, TheSameBoardUpsideDownIsAccepted) {
  EXPECT_TRUE(compare(shoot({.tilt_deg = 60.0, .turn_deg = 180.0, .centre = planned_middle()})).is_accepted());
}

TEST_F(Aid, WhatIsOffIsMeasured) {
  const Eigen::Vector3d beside(20.0, 0.0, 0.0);
  const auto view = compare(shoot({.tilt_deg = 48.0, .centre = planned_middle() + beside}));
  EXPECT_NEAR(view.off_deg.value_or(0.0), 12.0, 0.5);
  EXPECT_NEAR(view.off_mm.value_or(0.0), 20.0, 0.5);
  EXPECT_FALSE(view.is_accepted());
  EXPECT_THAT(describe(view), HasSubstr("12 deg and 20 mm off the plan"));
}

TEST_F(Aid, WithoutACalibrationOrAngleTheBoardIsOnlySeen) {
  const auto image = shoot({.tilt_deg = 60.0, .centre = planned_middle()});
  const auto view = compare_placement(image, image, "BayerRG8", board_, calibration_plan()[0], nullptr, 0.0);
  EXPECT_TRUE(view.left.is_seen && !view.off_deg && view.left.expected.empty());
  EXPECT_FALSE(compare(image, std::nullopt).off_deg);
}

TEST_F(Aid, AnEmptyTableIsNamed) {
  const auto view = compare(cv::Mat(960, 1280, CV_8UC1, cv::Scalar(90)));
  EXPECT_FALSE(view.left.is_seen || view.is_accepted());
  EXPECT_THAT(describe(view), HasSubstr("Left: "));
}

TEST(Plan, HasTheAnglesAroundEachMark) {
  int views = 0;
  for (const auto& placement : calibration_plan()) {
    const auto angles = placement_angles(placement);
    views += static_cast<int>(angles.size());
    for (const double angle : angles) EXPECT_LE(std::abs(angle), 180.0);
    if (!placement.is_flat()) {
      EXPECT_NEAR(std::remainder(angles[3] + placement.mark_deg, 360.0), 0.0, 1e-9);
    }
  }
  EXPECT_EQ(views, 50);
  EXPECT_NEAR(placement_angles(calibration_plan()[1]).front(), -176.0, 1e-9);
}

}  // namespace
}  // namespace scanrig
