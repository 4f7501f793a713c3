#include <gmock/gmock.h>

#include "tests/component/turntable/modbus_bench.h"

namespace scanrig {
namespace {

using namespace sim::wire;
using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr std::uint8_t kRead = 0x03, kWriteOne = 0x06, kWriteSeveral = 0x10;

bool is_read(const WireFrame& frame) { return frame.from_master && frame.bytes[1] == kRead; }
bool is_write(const WireFrame& frame, std::uint8_t function, std::uint16_t address) {
  return frame.from_master && frame.bytes[1] == function && frame.bytes[2] == address >> 8 &&
         frame.bytes[3] == (address & 0xFF);
}

struct Spoiled {
  const char* name;
  WireFault fault;
  ErrorCode code;
  bool hears_stop;
};

/// What every profile must do; the parameter is the drive.
class ModbusFaults : public testing::TestWithParam<ModbusKind> {
 protected:
  static void slow(ModbusTurntableOptions& options) { options.speed = {450}; }

  bool is_move(const WireFrame& frame) const {
    return is_write(frame, kWriteSeveral, bench_->options().profile.move.address);
  }
  bool is_stop(const WireFrame& frame) const {
    const auto& stop = bench_->options().profile.stop;
    return is_write(frame, kWriteOne, stop.address) && frame.bytes[4] == 0 && frame.bytes[5] == stop.value;
  }
  auto moves_sent() const {
    const auto log = bench_->server().log();
    return std::ranges::count_if(log, [this](const auto& frame) { return is_move(frame); });
  }

  /// The alarm of a table that cannot follow.
  static std::uint16_t following_error() { return GetParam().profile == kOriental.profile ? 0x10 : 0x20; }

  Deadline within(milliseconds time) { return Deadline::after(bench_->clock(), time); }
  Result<void> home() { return bench_->turntable().home(within(milliseconds(5000))); }
  Result<Move> rotate_to(double deg) { return bench_->turntable().rotate_to(Degrees{deg}, within(milliseconds(3000))); }

  void start(const ModbusBench::Change& change) {
    bench_.reset();
    bench_ = std::make_unique<ModbusBench>(GetParam(), change);
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
    const auto move = bench_->options().profile.move.address;
    bench_->server().on_request([move, act = std::move(act)](const ModbusRequest& request) {
      if (request.address == move) act();
    });
  }
  void expect_named_end(const Spoiled& spoiled);
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

  std::unique_ptr<ModbusBench> bench_ = std::make_unique<ModbusBench>(GetParam());
};

/// What only this family has.
class LeadshineFaults : public ModbusFaults {};

const std::vector<Spoiled>& all_spoiled() {
  constexpr auto forever = -1;
  static const std::vector<Spoiled> all{
      {"Silent", {WireFault::Kind::deaf, forever}, ErrorCode::timeout, false},
      {"AnswersLost", {WireFault::Kind::answer_lost, forever, kRead}, ErrorCode::timeout, true},
      {"Late", {WireFault::Kind::late, forever, kRead, milliseconds(50)}, ErrorCode::timeout, true},
      {"WrongCrc", {WireFault::Kind::wrong_crc, forever, kRead}, ErrorCode::protocol, true},
      {"CutShort", {WireFault::Kind::cut_short, forever, kRead}, ErrorCode::timeout, true},
      {"Refused", {WireFault::Kind::refuse, forever, kRead, {}, 4}, ErrorCode::protocol, true},
      {"EarlierAnswers", {WireFault::Kind::earlier_answer, forever, kRead}, ErrorCode::protocol, true}};
  return all;
}

TEST_P(ModbusFaults, SpoiledAnswersEndInTheirErrorWithinTheDeadlineWithTheTableAtRest) {
  for (const Spoiled& spoiled : all_spoiled()) {
    SCOPED_TRACE(spoiled.name);
    expect_named_end(spoiled);
  }
}

void ModbusFaults::expect_named_end(const Spoiled& spoiled) {
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

TEST_P(ModbusFaults, OneDamagedAnswerIsAskedForAgainAndCounted) {
  start_at_zero();
  const auto before = bench_->turntable().statistics();
  bench_->server().inject({WireFault::Kind::wrong_crc, 1, kRead});
  ASSERT_TRUE(rotate_to(45));
  const auto after = bench_->turntable().statistics();
  EXPECT_EQ(after.corrupt - before.corrupt, 1u);
  EXPECT_GE(after.retries - before.retries, 1u);
}

TEST_P(ModbusFaults, AMoveWhoseAnswerIsLostIsNotSentAgainOnceSeenRunning) {
  start_at_zero(slow);
  bench_->server().inject({WireFault::Kind::answer_lost, 1, kWriteSeveral});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(moved->measured.value, 45, 0.05);
  EXPECT_EQ(moves_sent(), 1);
}

TEST_P(ModbusFaults, AMoveThatWasNotHeardIsSentAgainOnlyAfterReading) {
  start_at_zero();
  bench_->server().inject({WireFault::Kind::deaf, 1, kWriteSeveral});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  ASSERT_EQ(moves_sent(), 2);
  const auto log = bench_->server().log();
  const auto move = [this](const auto& frame) { return is_move(frame); };
  const auto first = std::ranges::find_if(log, move);
  const auto second = std::find_if(first + 1, log.end(), move);
  EXPECT_TRUE(std::any_of(first, second, is_read));
  EXPECT_GE(bench_->turntable().statistics().retries, 1u);
}

TEST_P(ModbusFaults, APulledAdapterIsAnIoErrorAndTheDriveHearsStopFirstWhenItIsBack) {
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

TEST_P(ModbusFaults, TwoMastersCannotShareALine) {
  start_at_zero();
  modbus::LineOptions options;
  options.device = bench_->device();
  modbus::Line second(options, bench_->clock());
  const auto read = second.read(0x1003, 1, within(milliseconds(500)));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::io);
  EXPECT_THAT(read.error().message, HasSubstr("another program"));
}

TEST_P(ModbusFaults, AnAlarmIsToldInWordsAndHoldsUntilItIsReset) {
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->drive().raise_alarm(following_error()); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(moved.error().message, HasSubstr("is the table blocked"));
  expect_rest(89.0);
  const auto status = bench_->turntable().status(within(milliseconds(500)));
  ASSERT_TRUE(status);
  EXPECT_THAT(status->alarm, HasSubstr("is the table blocked"));
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::device_alarm);
  ASSERT_TRUE(bench_->turntable().reset_alarm(within(milliseconds(500))));
  expect_home_is_needed_and_helps();
}

TEST_P(ModbusFaults, EveryAlarmOfTheProfileIsToldInWords) {
  const auto& words = bench_->options().profile.alarm.words;
  ASSERT_FALSE(words.empty());
  for (const auto& [code, text] : words) {
    bench_->drive().raise_alarm(code);
    const auto status = bench_->turntable().status(within(milliseconds(500)));
    ASSERT_TRUE(status) << status.error().message;
    EXPECT_THAT(status->alarm, HasSubstr(text));
    EXPECT_THAT(status->alarm, HasSubstr(fmt::format("0x{:02X}", code)));
  }
}

TEST_P(ModbusFaults, AnAlarmThatStaysIsSaid) {
  bench_->drive().raise_alarm(0x7777, false);
  const auto reset = bench_->turntable().reset_alarm(within(milliseconds(1000)));
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(reset.error().message, HasSubstr("0x7777"));
  EXPECT_THAT(reset.error().message, HasSubstr("see the drive's manual"));
}

TEST_P(ModbusFaults, ADriveThatWantsAPowerCycleIsNotResetByRegister) {
  start([](auto& options) { options.profile.alarm.reset = DriveProfile::Alarm::Reset::power_cycle; });
  bench_->drive().raise_alarm(0x01);
  const auto reset = bench_->turntable().reset_alarm(within(milliseconds(1000)));
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm);
  EXPECT_THAT(reset.error().message, HasSubstr("switched off and on"));
  bench_->drive().power_cycle();
  EXPECT_TRUE(bench_->turntable().reset_alarm(within(milliseconds(1000))));
}

TEST_P(ModbusFaults, ADriveThatWasSwitchedOffInBetweenHasNoHomeUnlessItsEncoderKnowsIt) {
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

TEST_P(LeadshineFaults, ADisabledDriveIsNotSentAnywhere) {
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

TEST_P(ModbusFaults, LostStepsAreNotCalledArrival) {
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->drive().lose_steps(500); });  // 2 degrees
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::stalled) << moved.error().message;
  expect_home_is_needed_and_helps();
}

TEST_P(ModbusFaults, NoMoveIsSentWithoutHome) {
  ASSERT_FALSE(rotate_to(45));
  EXPECT_EQ(moves_sent(), 0);
}

TEST_P(ModbusFaults, ADriveSetToOtherPulsesIsRefused) {
  start([](auto& options) { options.scale.pulses_per_motor_rev = 4000; });
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::protocol);
  EXPECT_THAT(homed.error().message, HasSubstr("10000 pulses"));
}

TEST_P(ModbusFaults, AtTheEndOfTheCounterTheTableGoesTheOtherWayRound) {
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

TEST_P(ModbusFaults, ATableWhoseMotorRunsTheOtherWayStillCountsCounterClockwise) {
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

TEST_P(ModbusFaults, EveryMoveEndsCounterClockwise) {
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

TEST_P(ModbusFaults, SoftLimitsAreKeptByTheDriver) {
  start_at_zero([](auto& options) { options.soft_limits = AngleRange{{-10}, {200}}; });
  const auto moved = rotate_to(270);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::out_of_range);
  EXPECT_EQ(moves_sent(), 0);
  EXPECT_TRUE(rotate_to(180));
  EXPECT_TRUE(rotate_to(355));  // is -5
}

TEST_P(LeadshineFaults, SoftLimitsAreToldToTheDrive) {
  start_at_zero([](auto& options) { options.soft_limits = AngleRange{{-10}, {200}}; });
  std::array<std::uint16_t, 4> limits{};
  std::array<std::uint16_t, 1> control{};
  bench_->registers().read(0x6006, limits);
  bench_->registers().read(0x6000, control);
  EXPECT_EQ(control[0], 2);
  EXPECT_THAT(limits, testing::ElementsAre(0, 50000, 0xFFFF, 0x10000 - 2500));
}

TEST_P(ModbusFaults, HereCanBeHome) {
  start([](auto& options) { options.home_mode = "here"; });
  const double here = bench_->seen_deg();
  ASSERT_TRUE(home());
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(bench_->seen_deg() - here, 45, 0.3);
}

TEST_P(ModbusFaults, StopIsNotClaimedWithoutAnAnswer) {
  start_at_zero();
  bench_->server().inject({WireFault::Kind::deaf});
  const auto stopped = bench_->turntable().stop(within(milliseconds(600)));
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::timeout);
  EXPECT_THAT(stopped.error().message, HasSubstr("may be moving"));
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

std::string name(const testing::TestParamInfo<ModbusKind>& kind) {
  return kind.param.profile == kOriental.profile ? "Oriental" : "Leadshine";
}
INSTANTIATE_TEST_SUITE_P(Modbus, ModbusFaults, testing::Values(kLeadshine, kOriental), name);
INSTANTIATE_TEST_SUITE_P(Modbus, LeadshineFaults, testing::Values(kLeadshine), name);

}  // namespace
}  // namespace scanrig
