#include <atomic>

#include "tests/component/turntable/modbus_faults.h"

// The wire is sound; the drive misbehaves.

namespace scanrig {
namespace {

using testing::HasSubstr;

class ModbusDrives : public ModbusFaults {
 protected:
  /// The alarm of a table that cannot follow.
  static std::uint16_t following_error() { return GetParam().profile == kOriental.profile ? 0x10 : 0x20; }
};

/// Data of this family only.
class LeadshineDrives : public ModbusFaults {};

/// Drives with a communication time-out.
class TimeoutDrives : public ModbusFaults {
 protected:
  std::uint16_t held() {
    std::uint16_t held = 0;
    bench_->registers().read(bench_->options().profile.communication_timeout->address, {&held, 1});
    return held;
  }
};

TEST_P(ModbusDrives, AnAlarmIsToldInWordsAndHoldsUntilItIsReset) {
  start_at_zero(slow);
  expect_alarm_until_reset(following_error(), "is the table blocked");
  expect_home_is_needed_and_helps();
}

TEST_P(ModbusDrives, EveryAlarmOfTheProfileIsToldInWords) {
  const auto& words = bench_->options().profile.alarm.words;
  ASSERT_FALSE(words.empty());
  for (const auto& [code, text] : words) {
    bench_->drive().raise_alarm(code);
    const auto seen = status();
    ASSERT_TRUE(seen) << seen.error().message;
    EXPECT_THAT(seen->alarm, HasSubstr(text));
    EXPECT_THAT(seen->alarm, HasSubstr(fmt::format("0x{:02X}", code)));
  }
}

TEST_P(ModbusDrives, AnAlarmThatStaysIsSaid) {
  bench_->drive().raise_alarm(0x7777, false);
  const auto reset = reset_alarm();
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(reset.error().message, HasSubstr("0x7777"));
  EXPECT_THAT(reset.error().message, HasSubstr("see the drive's manual"));
}

TEST_P(ModbusDrives, ADriveThatWantsAPowerCycleIsNotResetByRegister) {
  start([](auto& options) { options.profile.alarm.reset = DriveProfile::Alarm::Reset::power_cycle; });
  bench_->drive().raise_alarm(0x01);
  const auto reset = reset_alarm();
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(reset.error().message, HasSubstr("switched off and on"));
  bench_->drive().power_cycle();
  EXPECT_TRUE(reset_alarm());
}

TEST_P(ModbusDrives, ADriveThatWasSwitchedOffInBetweenHasNoHomeUnlessItsEncoderKnowsIt) {
  start_at_zero();
  const double zero_deg = bench_->seen_deg();
  bench_->drive().power_cycle();
  const std::uint16_t on = 1;
  if (const auto& enable = bench_->options().profile.enable) bench_->registers().write(enable->address, {&on, 1});
  const auto moved = rotate_to(45);
  if (bench_->options().profile.homing.absolute) {
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_NEAR(bench_->seen_deg() - zero_deg, 45, 0.1);
    return;
  }
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::not_homed) << moved.error().message;
  EXPECT_EQ(moves_sent(), 0);
  expect_home_is_needed_and_helps();
}

TEST_P(LeadshineDrives, ADisabledDriveIsNotSentAnywhere) {
  start_at_zero();
  const std::uint16_t off = 0;
  bench_->registers().write(0x000F, {&off, 1});
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(moved.error().message, HasSubstr("emergency stop"));
  EXPECT_EQ(moves_sent(), 0);
  expect_home_is_needed_and_helps();
}

TEST_P(ModbusDrives, LostStepsAreNotCalledArrival) {
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->drive().lose_steps(500); });  // 2 degrees
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::stalled) << moved.error().message;
  expect_home_is_needed_and_helps();
}

TEST_P(ModbusDrives, NoMoveIsSentWithoutHome) {
  ASSERT_FALSE(rotate_to(45));
  EXPECT_EQ(moves_sent(), 0);
}

TEST_P(ModbusDrives, ADriveSetToOtherPulsesIsRefused) {
  start([](auto& options) { options.scale.pulses_per_motor_rev = 4000; });
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::protocol);
  EXPECT_THAT(homed.error().message, HasSubstr("10000 pulses"));
}

TEST_P(ModbusDrives, AtTheEndOfTheCounterTheTableGoesTheOtherWayRound) {
  start_at_zero();
  constexpr double kPulsesPerDegree = 250;
  // 20 degrees before the 32-bit counter is full.
  bench_->drive().preload_counter(std::numeric_limits<std::int32_t>::max() - 5000);
  const double here = (std::numeric_limits<std::int32_t>::max() - 5000) / kPulsesPerDegree;
  const double seen = bench_->seen_deg();
  const auto moved = rotate_to(std::fmod(here, 360.0) + 45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(moved->measured.value, moved->commanded.value, 0.05);
  EXPECT_NEAR(bench_->seen_deg() - seen, 45 - 360, 0.05);
}

TEST_P(ModbusDrives, ATableWhoseMotorRunsTheOtherWayStillCountsCounterClockwise) {
  start_at_zero([](auto& options) {
    options.scale.positive_ccw = false;
    options.scale.home_offset = {10};
  });
  EXPECT_NEAR(bench_->drive().counter(), -2500, 12);
  const double zero = bench_->seen_deg();
  ASSERT_TRUE(rotate_to(90));
  EXPECT_NEAR(bench_->drive().counter(), -25000, 12);
  EXPECT_NEAR(bench_->seen_deg() - zero, 90, 0.05);
  ASSERT_TRUE(rotate_to(45));
  EXPECT_NEAR(bench_->seen_deg() - zero, 45, 0.05);  // the backlash of the gear has no effect
}

TEST_P(ModbusDrives, EveryMoveEndsCounterClockwise) {
  start_at_zero();
  for (const double angle : {90.0, 45.0, 315.0, 0.0, 350.0}) ASSERT_TRUE(rotate_to(angle));
  const auto& words = bench_->options().profile.move.words;
  const auto high = std::ranges::find(words, DriveProfile::Block::Word::position, &DriveProfile::Block::Item::word);
  const auto at = static_cast<std::size_t>(7 + 2 * (high - words.begin()));
  double last = 0;
  for (const auto& frame : bench_->server().log()) {
    if (!is_move(frame)) continue;
    const auto& b = frame.bytes;
    const double target =
        static_cast<std::int32_t>(std::uint32_t{b[at]} << 24 | b[at + 1] << 16 | b[at + 2] << 8 | b[at + 3]);
    const bool final = std::abs(std::remainder(target / 250, 5.0)) < 0.01;
    if (final) {
      EXPECT_GT(target, last);
    }
    last = target;
  }
}

TEST_P(ModbusDrives, SoftLimitsAreKeptByTheDriver) {
  start_at_zero([](auto& options) { options.soft_limits = AngleRange{{-10}, {200}}; });
  const auto moved = rotate_to(270);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::out_of_range);
  EXPECT_EQ(moves_sent(), 0);
  EXPECT_TRUE(rotate_to(180));
  EXPECT_TRUE(rotate_to(355));  // is -5
}

TEST_P(LeadshineDrives, SoftLimitsAreToldToTheDrive) {
  start_at_zero([](auto& options) { options.soft_limits = AngleRange{{-10}, {200}}; });
  std::array<std::uint16_t, 4> limits{};
  std::array<std::uint16_t, 1> control{};
  bench_->registers().read(0x6006, limits);
  bench_->registers().read(0x6000, control);
  EXPECT_EQ(control[0], 2);
  EXPECT_THAT(limits, testing::ElementsAre(0, 50000, 0xFFFF, 0x10000 - 2500));
}

TEST_P(ModbusDrives, HereCanBeHome) {
  start([](auto& options) { options.home_mode = "here"; });
  const double here = bench_->seen_deg();
  ASSERT_TRUE(home());
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(bench_->seen_deg() - here, 45, 0.3);
}

TEST_P(TimeoutDrives, ATableWhoseCommanderIsGoneStopsByItself) {
  constexpr milliseconds kTimeout{500};
  start_at_zero([&](auto& options) {
    options.profile.communication_timeout->timeout = kTimeout;
    options.speed = {20};
  });
  const double begin = bench_->seen_deg();
  bench_->when_moving([&] { bench_->server().inject({.kind = WireFault::Kind::request_lost}); });  // no more input
  EXPECT_FALSE(rotate_to(170));
  const auto by = within(milliseconds(20'000));
  while (bench_->seen_moving() && !by.expired(bench_->clock())) bench_->clock().sleep_for(milliseconds(5));
  ASSERT_FALSE(bench_->seen_moving());
  EXPECT_LT(bench_->seen_deg() - begin, 100) << "it was sent 170 deg far, at 20 deg/s";
  bench_->server().clear_faults();
  const auto seen = status();
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_THAT(seen->alarm, HasSubstr("communication time-out"));
  ASSERT_TRUE(reset_alarm());
  expect_home_is_needed_and_helps();
}

TEST_P(TimeoutDrives, AtStandstillTheDriveWaitsForNobody) {
  start_at_zero();
  EXPECT_EQ(held(), 0);
  std::atomic<std::uint16_t> moving = 0;
  bench_->when_moving([&] { moving = held(); });
  ASSERT_TRUE(rotate_to(45));
  EXPECT_EQ(moving, bench_->options().profile.communication_timeout->timeout.count());
  EXPECT_EQ(held(), 0);
}

TEST_P(TimeoutDrives, ARegisterThatHoldsNoTimeoutIsNotWritten) {
  start([&](auto& options) { options.profile.communication_timeout->address = 0x0065; });  // the operating current
  const std::uint16_t other = 20'000;
  bench_->registers().write(0x0065, {&other, 1});
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::protocol);
  EXPECT_THAT(homed.error().message, HasSubstr("register 0x0065 holds 20000, not a communication time-out"));
  EXPECT_EQ(held(), other);
}

TEST(ModbusTurntableOptionsTest, WhatTheDriveCannotFollowIsRefusedBeforeThePortIsOpened) {
  RealClock clock;
  ModbusTurntableOptions options;
  options.scale.gear_ratio = 1000;
  const auto table = ModbusTurntable::create(options, clock);
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().code, ErrorCode::out_of_range);
  EXPECT_THAT(table.error().message, HasSubstr("7500 rpm"));
}

INSTANTIATE_TEST_SUITE_P(Modbus, ModbusDrives, testing::Values(kLeadshine, kOriental), drive_name);
INSTANTIATE_TEST_SUITE_P(Modbus, TimeoutDrives, testing::Values(kOriental), drive_name);
INSTANTIATE_TEST_SUITE_P(Modbus, LeadshineDrives, testing::Values(kLeadshine), drive_name);

}  // namespace
}  // namespace scanrig
