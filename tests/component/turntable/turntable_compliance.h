#pragma once

// Requirements on every Turntable. To test an implementation, derive a TurntableBench for it and write, in one source
// file of a test program: INSTANTIATE_TEST_SUITE_P(Name, TurntableCompliance, testing::Values(&make_bench));

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "tests/component/turntable/turntable_bench.h"

namespace scanrig {

/// Null where this machine has no such turntable.
using MakeTurntableBench = std::unique_ptr<TurntableBench> (*)();

class TurntableCompliance : public testing::TestWithParam<MakeTurntableBench> {
 protected:
  std::unique_ptr<TurntableBench> bench_ = GetParam()();

  void SetUp() override {
    if (!bench_) GTEST_SKIP() << "there is no such turntable here";
  }
  Deadline ample() { return Deadline::after(bench_->clock(), bench_->ample()); }
  Result<void> home() { return bench_->turntable().home(ample()); }
  Result<Move> rotate_to(double deg) { return bench_->turntable().rotate_to(Degrees{deg}, ample()); }

  bool comes_to_rest() {
    for (const auto by = Deadline::after(bench_->clock(), std::chrono::seconds(2)); !by.expired(bench_->clock());) {
      if (!bench_->seen_moving()) return true;
      bench_->clock().sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  /// Checks after a failure: stopped, turns only after home, and then as before.
  void expect_home_is_needed_and_helps() {
    EXPECT_TRUE(comes_to_rest());
    const double rest = bench_->seen_deg();
    const auto refused = rotate_to(10);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::not_homed) << refused.error().message;
    EXPECT_NEAR(bench_->seen_deg(), rest, bench_->tolerance().value);
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(45);
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_NEAR(moved->measured.value, 45.0, bench_->tolerance().value);
  }
};

TEST_P(TurntableCompliance, DoesNotTurnBeforeHome) {
  const double before = bench_->seen_deg();
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::not_homed);
  EXPECT_FALSE(bench_->seen_moving());
  EXPECT_EQ(bench_->seen_deg(), before);
}

TEST_P(TurntableCompliance, GoesRoundInEqualStepsCounterClockwiseAndBackToWhereItBegan) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(0));
  const double zero = bench_->seen_deg();
  for (int view = 1; view < 8; ++view) {
    const auto moved = rotate_to(45.0 * view);
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_EQ(moved->commanded, Degrees{45.0 * view});
    EXPECT_NEAR(moved->measured.value, 45.0 * view, bench_->tolerance().value);
    EXPECT_FALSE(bench_->seen_moving());
    EXPECT_NEAR(std::remainder(bench_->seen_deg() - zero - 45.0 * view, 360.0), 0.0, bench_->tolerance().value);
  }
  const auto closed = rotate_to(0);
  ASSERT_TRUE(closed) << closed.error().message;
  EXPECT_NEAR(closed->measured.value, 0.0, bench_->tolerance().value);
  EXPECT_NEAR(std::remainder(bench_->seen_deg() - zero, 360.0), 0.0, bench_->tolerance().value);
}

TEST_P(TurntableCompliance, StandsAtTheSameAngleFromWhicheverSideItCame) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(90));
  const double from_below = bench_->seen_deg();
  ASSERT_TRUE(rotate_to(135));
  ASSERT_TRUE(rotate_to(90));
  EXPECT_NEAR(std::remainder(bench_->seen_deg() - from_below, 360.0), 0.0, bench_->tolerance().value);
}

TEST_P(TurntableCompliance, StatusIsWhatTheDeviceSays) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(30));
  const auto status = bench_->turntable().status(ample());
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(status->motion, TurntableStatus::Motion::stopped);
  EXPECT_TRUE(status->homed);
  EXPECT_TRUE(status->alarm.empty());
  EXPECT_NEAR(std::remainder(status->angle.value_or(Degrees{30}).value - 30, 360.0), 0.0, bench_->tolerance().value);
}

TEST_P(TurntableCompliance, AnAngleThatIsNoneIsOutOfRange) {
  ASSERT_TRUE(home());
  const auto moved = rotate_to(std::numeric_limits<double>::quiet_NaN());
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::out_of_range);
}

TEST_P(TurntableCompliance, ABlockedTableIsStalled) {
  if (!bench_->can_block()) GTEST_SKIP() << "the bench cannot block the table";
  if (!bench_->has_feedback()) GTEST_SKIP() << "the device counts its steps and measures nothing";
  ASSERT_TRUE(home());
  bench_->block(true);
  const auto moved = rotate_to(90);
  bench_->block(false);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::stalled) << moved.error().message;
  expect_home_is_needed_and_helps();
}

TEST_P(TurntableCompliance, HomingABlockedTableIsStalled) {
  if (!bench_->can_block()) GTEST_SKIP() << "the bench cannot block the table";
  bench_->block(true);
  const auto homed = home();
  bench_->block(false);
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::stalled) << homed.error().message;
  expect_home_is_needed_and_helps();
}

TEST_P(TurntableCompliance, AMoveThatIsLateIsATimeout) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(0));
  const auto moved = bench_->turntable().rotate_to(Degrees{90}, Deadline::after(bench_->clock(), bench_->too_short()));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::timeout) << moved.error().message;
  expect_home_is_needed_and_helps();
}

TEST_P(TurntableCompliance, AnotherThreadStopsAMove) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(0));
  const double zero = bench_->seen_deg();
  bench_->when_moving([&] { bench_->turntable().request_stop(); });
  const auto moved = rotate_to(175);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::stopped) << moved.error().message;
  EXPECT_TRUE(comes_to_rest());
  EXPECT_LT(std::abs(bench_->seen_deg() - zero), 170.0);
  expect_home_is_needed_and_helps();
}

TEST_P(TurntableCompliance, AStopRequestedAtRestHoldsForTheNextMove) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(0));
  const double rest = bench_->seen_deg();
  bench_->turntable().request_stop();
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::stopped) << moved.error().message;
  EXPECT_NEAR(bench_->seen_deg(), rest, bench_->tolerance().value);
  expect_home_is_needed_and_helps();
}

TEST_P(TurntableCompliance, AStopRequestedAtRestEndsTheNextHomeAndNoMore) {
  const double rest = bench_->seen_deg();
  bench_->turntable().request_stop();
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::stopped) << homed.error().message;
  EXPECT_NEAR(bench_->seen_deg(), rest, bench_->tolerance().value);
  expect_home_is_needed_and_helps();
}

TEST_P(TurntableCompliance, AStopThatWasDeliveredAtRestEndsNoLaterMoveAndKeepsHome) {
  ASSERT_TRUE(home());
  ASSERT_TRUE(rotate_to(0));
  bench_->turntable().request_stop();
  ASSERT_TRUE(bench_->turntable().stop(ample()));
  bench_->turntable().drop_stop_request();
  const auto moved = rotate_to(30);
  EXPECT_TRUE(moved) << moved.error().message;
}

TEST_P(TurntableCompliance, StopReturnsOnceTheTableStands) {
  ASSERT_TRUE(home());
  const auto stopped = bench_->turntable().stop(ample());
  ASSERT_TRUE(stopped) << stopped.error().message;
  EXPECT_FALSE(bench_->seen_moving());
}

}  // namespace scanrig
