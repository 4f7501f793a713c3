#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "drivers/turntable/move_planner.h"

namespace scanrig {
namespace {

// 10000 pulses per motor turn, 90 motor turns per table turn: 2500 pulses per degree.
constexpr AxisScale kScale{10000, 90.0, true, {0}};
constexpr std::int64_t kTurn = 900'000;

MovePlanner planner(double backlash_deg = 0.5) { return {kScale, {backlash_deg}, {0.02}, std::nullopt}; }

TEST(AxisScaleTest, DegreesBecomePulsesThroughGearSignAndOffset) {
  EXPECT_DOUBLE_EQ(kScale.pulses({45}), 112'500);
  const AxisScale other{10000, 90.0, false, {10}};
  EXPECT_DOUBLE_EQ(other.pulses({45}), -137'500);
  EXPECT_DOUBLE_EQ(other.angle(-137'500).value, 45);
}

TEST(AxisScaleTest, SpeedAndAccelerationComeInTheDrivesUnits) {
  DriveProfile profile;  // rpm and ms per 1000 rpm
  // 45 deg/s are 7.5 turns per minute at the table, 675 at the motor; 90 deg/s2 are 1350 rpm/s: 1000 rpm take 741 ms.
  EXPECT_EQ(kScale.speed_word({45}, profile).value(), 675);
  EXPECT_EQ(kScale.acceleration_word({90}, profile).value(), 741);
  profile.speed_unit = DriveProfile::SpeedUnit::pulses_per_s;
  profile.acceleration_unit = DriveProfile::AccelerationUnit::pulses_per_s2;
  const AxisScale direct{1000, 1.0, true, {0}};
  EXPECT_EQ(direct.speed_word({45}, profile).value(), 125);
  EXPECT_EQ(direct.acceleration_word({90}, profile).value(), 250);
}

TEST(AxisScaleTest, WhatTheDriveCannotDoIsOutOfRange) {
  const DriveProfile profile;
  for (const double speed : {0.0, -1.0, 201.0, std::nan("")}) {
    const auto word = kScale.speed_word({speed}, profile);
    ASSERT_FALSE(word) << speed;
    EXPECT_EQ(word.error().code, ErrorCode::out_of_range);
  }
  for (const double acceleration : {0.0, -1.0, 0.5, 1e9, std::nan("")}) {
    EXPECT_FALSE(kScale.acceleration_word({acceleration}, profile)) << acceleration;
  }
}

TEST(MovePlannerTest, ForwardGoesStraight) {
  const auto plan = planner().plan(0, {45}, true);
  ASSERT_TRUE(plan);
  EXPECT_FALSE(plan->before);
  EXPECT_EQ(plan->target, 112'500);
}

TEST(MovePlannerTest, BackwardGoesPastTheTargetFirst) {
  const auto plan = planner().plan(225'000, {45}, true);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->before, 112'500 - 1250);
  EXPECT_EQ(plan->target, 112'500);
}

TEST(MovePlannerTest, WithoutPlayBackwardGoesStraightToo) {
  const auto plan = planner(0).plan(225'000, {45}, true);
  ASSERT_TRUE(plan);
  EXPECT_FALSE(plan->before);
}

TEST(MovePlannerTest, WhileThePlayIsNotTakenUpAShortWayForwardIsNotEnough) {
  EXPECT_TRUE(planner().plan(112'500, {45}, false)->before);
  EXPECT_FALSE(planner().plan(112'500, {45}, true)->before);
  EXPECT_FALSE(planner().plan(112'530, {45}, true)->before);  // 0.012 degrees: a correction
  EXPECT_FALSE(planner().plan(0, {45}, false)->before);
}

TEST(MovePlannerTest, TheShorterWayRoundIsTaken) {
  EXPECT_EQ(planner().plan(315 * 2500, {0}, true)->target, kTurn);
  EXPECT_EQ(planner().plan(0, {315}, true)->target, -45 * 2500);
  EXPECT_EQ(planner().plan(5 * kTurn, {-720 + 45}, true)->target, 5 * kTurn + 112'500);
}

TEST(MovePlannerTest, EveryPlanFitsTheDrivesCounter) {
  constexpr auto max = std::numeric_limits<std::int32_t>::max(), min = std::numeric_limits<std::int32_t>::min();
  for (const std::int64_t from : {std::int64_t{max}, max - kTurn / 3, std::int64_t{min}, min + kTurn / 3}) {
    for (double angle = 0; angle < 360; angle += 7.5) {
      const auto plan = planner().plan(static_cast<std::int32_t>(from), {angle}, true);
      ASSERT_TRUE(plan) << from << " " << angle;
      EXPECT_NEAR(std::remainder(kScale.angle(plan->target).value - angle, 360.0), 0.0, 0.001);
      EXPECT_LE(std::abs(std::int64_t{plan->target} - from), kTurn + 1);
      if (plan->before) {
        EXPECT_LT(*plan->before, plan->target);  // no wrap
      }
    }
  }
}

TEST(MovePlannerTest, CountingUpUntilTheCounterIsFullThenBackByLessThanATurn) {
  // 2386 turns fill 32 bits.
  std::int32_t at = 2385 * static_cast<std::int32_t>(kTurn);
  bool went_back = false;
  for (int view = 0; view < 40; ++view) {
    const auto plan = planner().plan(at, {45.0 * (view % 8)}, true);
    ASSERT_TRUE(plan);
    went_back = went_back || plan->target < at;
    at = plan->target;
    EXPECT_NEAR(std::remainder(kScale.angle(at).value - 45.0 * (view % 8), 360.0), 0.0, 0.001);
  }
  EXPECT_TRUE(went_back);
}

TEST(MovePlannerTest, SoftLimitsHoldForTheWayPastTheTargetToo) {
  MovePlanner limited = planner();
  limited.soft_limits = AngleRange{{0}, {400}};
  EXPECT_EQ(limited.plan(350 * 2500, {0}, true)->target, kTurn);  // 360, not 0
  EXPECT_EQ(limited.plan(390 * 2500, {5}, true)->target, 365 * 2500);
  EXPECT_EQ(limited.plan(390 * 2500, {45}, true)->target, 45 * 2500);  // 405 is outside
  limited.soft_limits = AngleRange{{0}, {300}};
  EXPECT_FALSE(limited.plan(100 * 2500, {310}, true));
  EXPECT_FALSE(limited.plan(100 * 2500, {0}, true));  // its approach from -0.5 is outside
}

TEST(MovePlannerTest, SoftLimitsFollowTheSignOfTheMotor) {
  MovePlanner limited = planner();
  limited.scale.positive_ccw = false;
  limited.soft_limits = AngleRange{{-10}, {200}};
  EXPECT_EQ(limited.counter_range().min, -500'000);
  EXPECT_EQ(limited.counter_range().max, 25'000);
  const auto plan = limited.plan(-250'000, {45}, true);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->target, -112'500);
  EXPECT_EQ(plan->before, -112'500 + 1250);  // from the clockwise side as seen from above
}

TEST(MovePlannerTest, AnAngleThatIsNoneHasNoPlan) {
  EXPECT_FALSE(planner().plan(0, {std::nan("")}, true));
  EXPECT_FALSE(planner().plan(0, {std::numeric_limits<double>::infinity()}, true));
}

}  // namespace
}  // namespace scanrig
