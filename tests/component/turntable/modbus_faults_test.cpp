#include <gmock/gmock.h>

#include <algorithm>

#include "tests/component/turntable/modbus_bench.h"

namespace scanrig {
namespace {

using sim::wire::Bytes;
using sim::wire::ModbusRequest;
using sim::wire::WireFault;
using sim::wire::WireFrame;
using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr std::uint8_t kRead = 0x03, kWriteOne = 0x06, kWriteSeveral = 0x10;

bool is_move(const WireFrame& frame) {
  return frame.from_master && frame.bytes[1] == kWriteSeveral && frame.bytes[2] == 0x62;
}
bool is_stop(const WireFrame& frame) {
  return frame.from_master && frame.bytes == Bytes{0x01, 0x06, 0x60, 0x02, 0x00, 0x40, 0x37, 0xFA};
}
bool is_read(const WireFrame& frame) { return frame.from_master && frame.bytes[1] == kRead; }

class ModbusFaults : public testing::Test {
 protected:
  static void slow(ModbusTurntableOptions& options) { options.speed = {450}; }

  Deadline within(milliseconds time) { return Deadline::after(bench_->clock(), time); }
  Result<void> home() { return bench_->turntable().home(within(milliseconds(5000))); }
  Result<Move> rotate_to(double deg) { return bench_->turntable().rotate_to(Degrees{deg}, within(milliseconds(3000))); }

  void start(const ModbusBench::Change& change) {
    bench_.reset();
    bench_ = std::make_unique<ModbusBench>(change);
  }
  void start_at_zero(const ModbusBench::Change& change = [](auto&) {}) {
    start(change);
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(0);
    ASSERT_TRUE(moved) << moved.error().message;
    bench_->server().clear_log();
  }
  /// From the next move on, after it has been heard.
  void once_turning(std::function<void()> act) {
    bench_->server().on_request([act = std::move(act)](const ModbusRequest& request) {
      if (request.address == 0x6200) act();
    });
  }
  void expect_rest(double by_deg) {
    for (const auto by = within(milliseconds(2000)); bench_->seen_moving() && !by.expired(bench_->clock());) {
      bench_->clock().sleep_for(milliseconds(2));
    }
    EXPECT_FALSE(bench_->seen_moving());
    EXPECT_LT(bench_->seen_deg(), by_deg);
  }
  void expect_home_is_needed_and_helps() {
    bench_->server().on_request({});
    const auto refused = rotate_to(10);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::not_homed) << refused.error().message;
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(10);
    ASSERT_TRUE(moved) << moved.error().message;
  }
  auto sent(bool (*kind)(const WireFrame&)) {
    const auto log = bench_->server().log();
    return std::ranges::count_if(log, kind);
  }

  std::unique_ptr<ModbusBench> bench_ = std::make_unique<ModbusBench>();
};

struct Spoiled {
  const char* name;
  WireFault fault;
  ErrorCode code;
  bool hears_stop;
};

class SpoiledAnswers : public ModbusFaults, public testing::WithParamInterface<Spoiled> {};

TEST_P(SpoiledAnswers, EndInTheirErrorWithinTheDeadlineWithTheTableAtRest) {
  const Spoiled& spoiled = GetParam();
  start_at_zero(slow);
  once_turning([&] { bench_->server().inject(spoiled.fault); });
  const auto began = bench_->clock().now();
  const auto moved = rotate_to(175);
  EXPECT_LT(bench_->clock().now() - began, milliseconds(3000));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, spoiled.code) << moved.error().message;
  EXPECT_THAT(moved.error().message, HasSubstr(spoiled.hears_stop ? "told to stop" : "may be moving"));
  bench_->server().clear_faults();
  if (!spoiled.hears_stop) {
    // The first thing the drive hears when it listens again.
    bench_->server().clear_log();
    EXPECT_TRUE(bench_->turntable().status(within(milliseconds(2000))));
    ASSERT_FALSE(bench_->server().log().empty());
    EXPECT_TRUE(is_stop(bench_->server().log().front()));
  }
  expect_rest(spoiled.hears_stop ? 174.0 : 176.0);
  expect_home_is_needed_and_helps();
}

constexpr auto forever = -1;
INSTANTIATE_TEST_SUITE_P(
    All, SpoiledAnswers,
    testing::Values(
        Spoiled{"Silent", {WireFault::Kind::deaf, forever}, ErrorCode::timeout, false},
        Spoiled{"AnswersLost", {WireFault::Kind::answer_lost, forever, kRead}, ErrorCode::timeout, true},
        Spoiled{"Late", {WireFault::Kind::late, forever, kRead, milliseconds(50)}, ErrorCode::timeout, true},
        Spoiled{"WrongCrc", {WireFault::Kind::wrong_crc, forever, kRead}, ErrorCode::protocol, true},
        Spoiled{"CutShort", {WireFault::Kind::cut_short, forever, kRead}, ErrorCode::timeout, true},
        Spoiled{"Refused", {WireFault::Kind::refuse, forever, kRead, {}, 4}, ErrorCode::protocol, true},
        Spoiled{"EarlierAnswers", {WireFault::Kind::earlier_answer, forever, kRead}, ErrorCode::protocol, true}),
    [](const auto& spoiled) { return spoiled.param.name; });

TEST_F(ModbusFaults, OneDamagedAnswerIsAskedForAgainAndCounted) {
  start_at_zero();
  const auto before = bench_->turntable().statistics();
  bench_->server().inject({WireFault::Kind::wrong_crc, 1, kRead});
  ASSERT_TRUE(rotate_to(45));
  const auto after = bench_->turntable().statistics();
  EXPECT_EQ(after.corrupt - before.corrupt, 1u);
  EXPECT_GE(after.retries - before.retries, 1u);
}

TEST_F(ModbusFaults, AMoveWhoseAnswerIsLostIsNotSentAgainOnceSeenRunning) {
  start_at_zero(slow);
  bench_->server().inject({WireFault::Kind::answer_lost, 1, kWriteSeveral});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(moved->measured.value, 45, 0.05);
  EXPECT_EQ(sent(is_move), 1);
}

TEST_F(ModbusFaults, AMoveThatWasNotHeardIsSentAgainOnlyAfterReading) {
  start_at_zero();
  bench_->server().inject({WireFault::Kind::deaf, 1, kWriteSeveral});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  ASSERT_EQ(sent(is_move), 2);
  const auto log = bench_->server().log();
  const auto first = std::ranges::find_if(log, is_move);
  const auto second = std::find_if(first + 1, log.end(), is_move);
  EXPECT_TRUE(std::any_of(first, second, is_read));
  EXPECT_GE(bench_->turntable().statistics().retries, 1u);
}

TEST_F(ModbusFaults, APulledAdapterIsAnIoErrorAndTheDriveHearsStopFirstWhenItIsBack) {
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->server().vanish(); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::io) << moved.error().message;
  EXPECT_THAT(moved.error().message, HasSubstr("may be moving"));
  const auto gone = bench_->turntable().status(within(milliseconds(500)));
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, ErrorCode::io);

  bench_->server().clear_log();
  ASSERT_TRUE(bench_->server().come_back());
  const auto back = bench_->turntable().status(within(milliseconds(500)));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_FALSE(back->homed);
  EXPECT_TRUE(is_stop(bench_->server().log().front()));
  expect_rest(180.0);
  expect_home_is_needed_and_helps();
}

TEST_F(ModbusFaults, TwoMastersCannotShareALine) {
  start_at_zero();
  modbus::LineOptions options;
  options.device = bench_->device();
  modbus::Line second(options, bench_->clock());
  const auto read = second.read(0x1003, 1, within(milliseconds(500)));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::io);
  EXPECT_THAT(read.error().message, HasSubstr("another program"));
}

TEST_F(ModbusFaults, AnAlarmIsToldInWordsAndHoldsUntilItIsReset) {
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->drive().raise_alarm(0x20); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(moved.error().message, HasSubstr("position following error"));
  expect_rest(89.0);
  const auto status = bench_->turntable().status(within(milliseconds(500)));
  ASSERT_TRUE(status);
  EXPECT_THAT(status->alarm, HasSubstr("position following error"));
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::device_alarm);
  ASSERT_TRUE(bench_->turntable().reset_alarm(within(milliseconds(500))));
  expect_home_is_needed_and_helps();
}

TEST_F(ModbusFaults, AnAlarmThatStaysIsSaid) {
  bench_->drive().raise_alarm(0x7777, false);
  const auto reset = bench_->turntable().reset_alarm(within(milliseconds(1000)));
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(reset.error().message, HasSubstr("0x7777"));
}

TEST_F(ModbusFaults, ADriveThatWantsAPowerCycleIsNotResetByRegister) {
  start([](auto& options) { options.profile.alarm.reset = DriveProfile::Alarm::Reset::power_cycle; });
  bench_->drive().raise_alarm(0x01);
  const auto reset = bench_->turntable().reset_alarm(within(milliseconds(1000)));
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(reset.error().message, HasSubstr("switched off and on"));
  bench_->drive().power_cycle();
  EXPECT_TRUE(bench_->turntable().reset_alarm(within(milliseconds(1000))));
}

TEST_F(ModbusFaults, ADriveThatWasSwitchedOffInBetweenHasNoHome) {
  start_at_zero();
  bench_->drive().power_cycle();
  const std::uint16_t on = 1;
  bench_->leadshine().write(0x000F, {&on, 1});
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::not_homed) << moved.error().message;
  EXPECT_EQ(sent(is_move), 0);
  expect_home_is_needed_and_helps();
}

TEST_F(ModbusFaults, ADisabledDriveIsNotSentAnywhere) {
  start_at_zero();
  const std::uint16_t off = 0;
  bench_->leadshine().write(0x000F, {&off, 1});
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(moved.error().message, HasSubstr("emergency stop"));
  EXPECT_EQ(sent(is_move), 0);
  expect_home_is_needed_and_helps();
}

TEST_F(ModbusFaults, LostStepsAreNotCalledArrival) {
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->drive().lose_steps(500); });  // 2 degrees
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::stalled) << moved.error().message;
  expect_home_is_needed_and_helps();
}

TEST_F(ModbusFaults, NoMoveIsSentWithoutHome) {
  ASSERT_FALSE(rotate_to(45));
  EXPECT_EQ(sent(is_move), 0);
}

TEST_F(ModbusFaults, ADriveSetToOtherPulsesIsRefused) {
  start([](auto& options) { options.scale.pulses_per_motor_rev = 4000; });
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::protocol);
  EXPECT_THAT(homed.error().message, HasSubstr("10000 pulses"));
}

TEST_F(ModbusFaults, AtTheEndOfTheCounterTheTableGoesTheOtherWayRound) {
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

TEST_F(ModbusFaults, ATableWhoseMotorRunsTheOtherWayStillCountsCounterClockwise) {
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
  EXPECT_NEAR(bench_->seen_deg() - zero, 45, 0.05);  // the play of the gear does not show
}

TEST_F(ModbusFaults, EveryMoveEndsCounterClockwise) {
  start_at_zero();
  for (const double angle : {90.0, 45.0, 315.0, 0.0, 350.0}) ASSERT_TRUE(rotate_to(angle));
  double last = 0;
  for (const auto& frame : bench_->server().log()) {
    if (!is_move(frame)) continue;
    const auto& b = frame.bytes;
    const double target = static_cast<std::int32_t>(std::uint32_t{b[9]} << 24 | b[10] << 16 | b[11] << 8 | b[12]);
    const bool final = std::abs(std::remainder(target / 250, 5.0)) < 0.01;
    if (final) {
      EXPECT_GT(target, last);
    }
    last = target;
  }
}

TEST_F(ModbusFaults, SoftLimitsAreKeptByTheDriverAndToldToTheDrive) {
  start_at_zero([](auto& options) { options.soft_limits = AngleRange{{-10}, {200}}; });
  EXPECT_EQ(bench_->leadshine().peek(0x6000), 2);
  EXPECT_EQ(bench_->leadshine().peek(0x6007), 50000);
  EXPECT_EQ(bench_->leadshine().peek(0x6008), 0xFFFF);
  EXPECT_EQ(bench_->leadshine().peek(0x6009), 0x10000 - 2500);
  const auto moved = rotate_to(270);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::out_of_range);
  EXPECT_EQ(sent(is_move), 0);
  EXPECT_TRUE(rotate_to(180));
  EXPECT_TRUE(rotate_to(355));  // is -5
}

TEST_F(ModbusFaults, HereCanBeHome) {
  start([](auto& options) { options.home_mode = "here"; });
  const double here = bench_->seen_deg();
  ASSERT_TRUE(home());
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(bench_->seen_deg() - here, 45, 0.3);
}

TEST_F(ModbusFaults, StopIsNotClaimedWithoutAnAnswer) {
  start_at_zero();
  bench_->server().inject({WireFault::Kind::deaf});
  const auto stopped = bench_->turntable().stop(within(milliseconds(600)));
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::timeout);
  EXPECT_THAT(stopped.error().message, HasSubstr("may be moving"));
}

TEST_F(ModbusFaults, OptionsTheDriveCannotFollowAreRefusedBeforeThePortIsOpened) {
  RealClock clock;
  ModbusTurntableOptions options;
  options.scale.gear_ratio = 1000;
  const auto table = ModbusTurntable::create(options, clock);
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().code, ErrorCode::out_of_range);
  EXPECT_THAT(table.error().message, HasSubstr("7500 rpm"));
}

}  // namespace
}  // namespace scanrig
