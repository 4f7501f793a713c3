#include "drivers/camera/trigger_tracker.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

using Finding = TriggerTracker::Finding;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kGigeIds = 65535;
constexpr auto kAhead = std::chrono::hours(3);  // the sensor's clock against the host's

/// A frame exposed `after` the start, by a sensor whose clock runs ahead.
FrameStamp frame(std::uint64_t id, std::chrono::nanoseconds after) { return {id, kAhead + after}; }
HostWindow window(std::chrono::nanoseconds begin, std::chrono::nanoseconds end) {
  return {Clock::TimePoint(begin), Clock::TimePoint(end)};
}

class LedgerTest : public testing::Test {
 protected:
  TriggerTracker ledger_{kGigeIds, false};

  /// A frame exposed 1 ms after the window began, here 5 ms later.
  void take(std::uint64_t id, std::chrono::nanoseconds at) {
    const auto seen = window(at - milliseconds(1), at + milliseconds(5));
    EXPECT_EQ(ledger_.check(frame(id, at), seen), Finding::in_order);
    ledger_.accept(frame(id, at), seen);
  }
  Finding check(std::uint64_t id, std::chrono::nanoseconds at, std::chrono::nanoseconds armed) {
    return ledger_.check(frame(id, at), window(armed, armed + milliseconds(20)));
  }
};

TEST_F(LedgerTest, TheFirstFrameIsTakenAndMakesTheClockKnown) {
  EXPECT_FALSE(ledger_.knows_clock());
  EXPECT_FALSE(ledger_.uncertainty());
  take(7, seconds(1));
  EXPECT_TRUE(ledger_.knows_clock());
  EXPECT_GE(*ledger_.uncertainty(), milliseconds(6));
  EXPECT_LE(*ledger_.uncertainty(), milliseconds(12));
}

TEST_F(LedgerTest, AGapOfIdsIsFramesMissing) {
  take(7, seconds(1));
  EXPECT_EQ(check(9, seconds(2), seconds(2)), Finding::frames_missing);
  EXPECT_EQ(check(8, seconds(2), seconds(2)), Finding::in_order);
}

TEST_F(LedgerTest, GigeIdsBeginAgainAtOne) {
  take(65535, seconds(1));
  EXPECT_EQ(check(1, seconds(2), seconds(2)), Finding::in_order);
  EXPECT_EQ(check(2, seconds(2), seconds(2)), Finding::frames_missing);
  EXPECT_EQ(check(65534, seconds(2), seconds(2)), Finding::old_frame);
}

TEST_F(LedgerTest, LongIdsDoNotBeginAgain) {
  take(65535, seconds(1));
  EXPECT_EQ(check(65536, seconds(2), seconds(2)), Finding::in_order);
}

TEST_F(LedgerTest, TheSameIdOrStampIsAnOldFrame) {
  take(7, seconds(1));
  EXPECT_EQ(check(7, seconds(2), seconds(2)), Finding::old_frame);
  EXPECT_EQ(check(8, seconds(1), seconds(1)), Finding::old_frame);
}

TEST_F(LedgerTest, AnExposureFromBeforeItsTriggerIsOldWhateverItsId) {
  take(7, seconds(1));
  EXPECT_EQ(check(8, seconds(2), seconds(2) + milliseconds(10)), Finding::old_frame);
}

TEST_F(LedgerTest, AnExposureAfterItsArrivalIsAClockThatJumped) {
  take(7, seconds(1));
  EXPECT_EQ(check(8, seconds(3), seconds(2)), Finding::clock_jumped);
}

TEST_F(LedgerTest, DriftOfTwoCrystalsIsNotOldAge) {
  take(7, seconds(1));
  // An hour later the sensor's clock has fallen back by 0.36 s (100 ppm).
  const auto hour = std::chrono::hours(1);
  const FrameStamp late{8, kAhead + hour - milliseconds(360)};
  EXPECT_EQ(ledger_.check(late, window(hour, hour + milliseconds(20))), Finding::in_order);
}

TEST_F(LedgerTest, TheHostTimeOfAnExposureIsWithinItsWindow) {
  take(7, seconds(1));
  const auto seen = window(seconds(2), seconds(2) + milliseconds(50));
  const auto when = ledger_.host_time(frame(8, seconds(2) + milliseconds(10)), seen);
  EXPECT_NEAR(std::chrono::duration<double>(when.time_since_epoch()).count(), 2.010, 0.005);
}

TEST_F(LedgerTest, WhatIsForgottenIsNotHeldAgainstTheNextFrame) {
  take(700, seconds(5));
  ledger_.forget();
  EXPECT_EQ(check(3, seconds(1), seconds(1)), Finding::in_order);
}

TEST(HostClockTracker, KnowsItsClockFromTheBeginning) {
  TriggerTracker ledger(std::uint64_t{1} << 32, true);
  const HostWindow seen = window(seconds(2), seconds(3));
  EXPECT_EQ(ledger.check({0, seconds(1)}, seen), Finding::old_frame);
  EXPECT_EQ(ledger.check({0, milliseconds(2500)}, seen), Finding::in_order);
  ledger.accept({0xFFFFFFFF, milliseconds(2500)}, seen);
  EXPECT_EQ(ledger.check({0, milliseconds(2600)}, seen), Finding::in_order);
}

TEST(PairTolerance, GrowsWithTheTimeSinceTheLastPair) {
  EXPECT_GE(pair_tolerance(seconds(0)), std::chrono::microseconds(500));
  EXPECT_LE(pair_tolerance(seconds(0)), milliseconds(2));
  EXPECT_GE(pair_tolerance(seconds(100)), milliseconds(20));
}

}  // namespace
}  // namespace scanrig
