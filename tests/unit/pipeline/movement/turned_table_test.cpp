#include "pipeline/movement/turned_table.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

const double kLimit = CompareViewsOptions{}.max_shift_px;

/// Cameras 500 mm from the axis, where a pixel spans 0.25 mm, over a table of 180 mm.
class TurnedTable : public testing::Test {
 protected:
  TurnedTable() {
    rig.left.projection = {.width = 1280, .height = 960, .fx = 2000, .fy = 2000, .cx = 640, .cy = 480};
    rig.left.camera_from_turntable.translation() = Eigen::Vector3d(0, 300, 400);
    rig.table_radius_mm = 90;
  }
  double allowed(double turned_deg) const { return allowing_for(turned_deg, rig.left, rig).max_shift_px; }
  Calibration rig;
};

TEST_F(TurnedTable, AtTheSameAngleAddsNothing) {
  EXPECT_DOUBLE_EQ(allowed(0.0), kLimit);
  EXPECT_NEAR(allowed(360.0), kLimit, 1e-9) << "whole turns do not count";
  EXPECT_NEAR(allowed(-720.0), kLimit, 1e-9);
}

/// The rim of an object of 60 mm moves to its projected place.
TEST_F(TurnedTable, MovesTheRimOfTheLargestObjectByTheAddedLimit) {
  const double turned = 0.02 * 3.14159265358979 / 180.0;
  const Eigen::Vector3d rim(60, 0, 0), after = Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitY()) * rim;
  const double moved_px = (after - rim).norm() / rig.left.projection.mm_per_pixel(500);
  EXPECT_NEAR(allowed(0.02) - kLimit, moved_px, 1e-4);
  EXPECT_NEAR(moved_px, 0.0838, 1e-4);
}

TEST_F(TurnedTable, AddsTheSameInBothDirectionsAndAcrossTheTurn) {
  EXPECT_DOUBLE_EQ(allowed(-0.02), allowed(0.02));
  EXPECT_NEAR(allowed(359.98), allowed(0.02), 1e-9);
  EXPECT_NEAR(allowed(0.04) - kLimit, 2 * (allowed(0.02) - kLimit), 1e-9);
}

TEST_F(TurnedTable, AddsInProportionToSizeAndDistance) {
  const double usual = allowed(0.02) - kLimit;
  rig.table_radius_mm = 180;
  EXPECT_NEAR(allowed(0.02) - kLimit, 2 * usual, 1e-9) << "larger objects";
  rig.left.camera_from_turntable.translation() *= 2;
  EXPECT_NEAR(allowed(0.02) - kLimit, usual, 1e-9) << "from twice as far";
}

}  // namespace
}  // namespace scanrig
