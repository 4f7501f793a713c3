#include <gmock/gmock.h>

#include "tests/component/turntable/grbl_bench.h"
#include "tests/component/turntable/turntable_faults.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr std::uint8_t kReport = '?', kLine = 'G';

class GrblFaults : public testing::Test, protected TurntableFaults {
 protected:
  static void slow(GrblTurntableOptions& options, sim::wire::GrblSettings&) { options.speed = {450}; }

  static std::string text_of(const WireFrame& frame) { return {frame.bytes.begin(), frame.bytes.end()}; }
  bool is_move(const WireFrame& frame) const override { return frame.from_master && text_of(frame).starts_with("G"); }
  bool is_read(const WireFrame& frame) const override { return frame.from_master && text_of(frame) == "?"; }
  bool is_stop(const WireFrame& frame) const override { return frame.from_master && text_of(frame) == "!"; }
  std::uint8_t moving() const override { return kLine; }
  std::uint8_t reading() const override { return kReport; }
  WireBench& bench() override { return *bench_; }

  void start(const GrblBench::Change& change = [](auto&, auto&) {}) {
    bench_.reset();
    bench_ = std::make_unique<GrblBench>(change);
  }
  void start_at_zero(const GrblBench::Change& change = [](auto&, auto&) {}) {
    start(change);
    go_to_zero();
  }

  std::unique_ptr<GrblBench> bench_ = std::make_unique<GrblBench>();
};

TEST_F(GrblFaults, SpoiledAnswersEndInTheirErrorWithinTheDeadlineWithTheTableAtRest) {
  constexpr auto forever = -1;
  const std::vector<Spoiled> all{
      {"Silent", {WireFault::Kind::request_lost}, ErrorCode::timeout, false},
      {"AnswersLost", {WireFault::Kind::reply_lost, forever, kReport}, ErrorCode::timeout, true},
      {"Late", {WireFault::Kind::late, forever, kReport, milliseconds(50)}, ErrorCode::timeout, true},
      {"AsLateAsIsWaitedFor", {WireFault::Kind::late, forever, kReport, milliseconds(80)}, ErrorCode::timeout, true},
      {"Damaged", {WireFault::Kind::wrong_crc, forever, kReport}, ErrorCode::protocol, true},
      {"CutShort", {WireFault::Kind::cut_short, forever, kReport}, ErrorCode::timeout, true},
      {"EarlierAnswers", {WireFault::Kind::earlier_reply, forever, kReport}, ErrorCode::protocol, true}};
  for (const Spoiled& spoiled : all) {
    SCOPED_TRACE(spoiled.name);
    start_at_zero(slow);
    bench_->when_moving([&] { bench_->server().inject(spoiled.fault); });
    expect_named_end(spoiled);
    expect_home_is_needed_and_helps();
  }
}

TEST_F(GrblFaults, OneDamagedReportIsAskedForAgainAndCounted) {
  start_at_zero();
  expect_one_damaged_answer_asked_for_again();
}

TEST_F(GrblFaults, AMoveWhoseAnswerIsLostIsNotSentAgainOnceSeenRunning) {
  start_at_zero(slow);
  expect_move_not_sent_again_once_seen_running();
}

TEST_F(GrblFaults, AMoveThatWasNotHeardIsSentAgainOnlyAfterReading) {
  start_at_zero();
  expect_move_sent_again_only_after_reading();
}

TEST_F(GrblFaults, AMoveThatIsRefusedIsToldInWordsAndNotSentAgain) {
  start_at_zero();
  bench_->server().inject({.kind = WireFault::Kind::refuse, .function = kLine, .exception = 22});
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::protocol);
  EXPECT_THAT(moved.error().message, HasSubstr("no feed rate (error:22)"));
  EXPECT_EQ(moves_sent(), 1);
  bench_->server().clear_faults();
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, OkIsQueuedNotArrived) {
  start_at_zero(slow);
  const auto moved = rotate_to(90);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_GT(moved->moving, milliseconds(150)) << "90 degrees at 450 deg/s take 200 ms";
  EXPECT_GE(moved->settling, milliseconds(60));
  EXPECT_FALSE(bench_->seen_moving());
}

TEST_F(GrblFaults, APulledAdapterIsAnIoErrorAndTheControllerHearsStopFirstWhenItIsBack) {
  start_at_zero(slow);
  expect_stop_first_after_a_pulled_adapter();
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, TwoProgramsCannotShareALine) {
  start_at_zero();
  RealClock clock;
  grbl::Link second({bench_->device()}, clock);
  const auto report = second.report(within(milliseconds(500)));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::io);
  EXPECT_THAT(report.error().message, HasSubstr("another program"));
}

TEST_F(GrblFaults, AnAlarmIsToldInWordsAndHoldsUntilItIsReset) {
  start_at_zero(slow);
  expect_alarm_until_reset(1, "a limit switch was hit");
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, AnAlarmIsWhatTheFirmwareMeansByIt) {
  start_at_zero([](auto& options, auto& settings) {
    slow(options, settings);
    settings.firmware = sim::wire::GrblFirmware::grblhal;
  });
  expect_alarm_until_reset(10, "its emergency stop input is open");
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, FluidNcIsSetUpInItsFile) {
  const auto fluidnc = [](auto& settings) { settings.firmware = sim::wire::GrblFirmware::fluidnc; };
  start([&](auto&, auto& settings) {
    fluidnc(settings);
    settings.homing = false;
  });
  auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_THAT(homed.error().message, HasSubstr("give the axis a homing cycle in its file"));
  start([&](auto&, auto& settings) {
    fluidnc(settings);
    settings.acceleration_deg_s2 = 30000;
  });
  homed = home();
  ASSERT_FALSE(homed);
  EXPECT_THAT(homed.error().message, HasSubstr("set acceleration_mm_per_sec2: 180000.000 in its file"));
}

TEST_F(GrblFaults, AnAlarmThatStaysIsSaid) {
  start_at_zero();
  bench_->drive().raise_alarm(1, false);
  const auto reset = reset_alarm();
  ASSERT_FALSE(reset);
  EXPECT_EQ(reset.error().code, ErrorCode::device_alarm) << reset.error().message;
}

TEST_F(GrblFaults, AControllerThatRestartedAtRestHasNoHome) {
  start_at_zero();
  bench_->drive().power_cycle();
  const auto moved = rotate_to(45);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::not_homed) << moved.error().message;
  EXPECT_EQ(moves_sent(), 0);
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, AControllerThatRestartsInTheMiddleOfAMoveHasNoHome) {
  // This also covers a controller that is not locked after a restart and would accept the next move.
  start_at_zero([](auto& options, auto& settings) {
    slow(options, settings);
    options.home_mode = "here";
    settings.homing = false;
  });
  bench_->when_moving([&] { bench_->drive().power_cycle(); });
  const auto moved = rotate_to(170);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::not_homed) << moved.error().message;
  EXPECT_EQ(moves_sent(), 1);
}

TEST_F(GrblFaults, TheLockIsNeverLiftedButByHoming) {
  start_at_zero();
  bench_->drive().raise_alarm(3);
  EXPECT_FALSE(rotate_to(45));
  EXPECT_TRUE(reset_alarm());
  EXPECT_TRUE(home());
  for (const auto& frame : bench_->server().log()) {
    if (!frame.from_master) continue;
    EXPECT_THAT(text_of(frame), Not(HasSubstr("$X")));
  }
}

TEST_F(GrblFaults, AControllerSetUpOtherwiseIsRefusedWithWhatToSet) {
  start([](auto&, auto& settings) { settings.homing = false; });
  auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::protocol);
  EXPECT_THAT(homed.error().message, HasSubstr("set $22=1"));
  start([](auto&, auto& settings) { settings.acceleration_deg_s2 = 30000; });
  homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::protocol);
  EXPECT_THAT(homed.error().message, HasSubstr("$120=180000"));
}

TEST_F(GrblFaults, AStopWhileHomingIsAReset) {
  start([](auto&, auto& settings) { settings.homing_deg_s = 100; });
  bench_->when_moving([&] { bench_->turntable().request_stop(); });
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::stopped) << homed.error().message;
  EXPECT_THAT(homed.error().message, HasSubstr("told to stop"));
  expect_rest(360);
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, AStopAtRestIsLeftAgain) {
  start_at_zero();
  ASSERT_TRUE(bench_->turntable().stop(within(milliseconds(1000))));
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(bench_->seen_deg(), 45, 0.3);
}

TEST_F(GrblFaults, OptionsThatCannotBeAreRefusedBeforeThePortIsOpened) {
  RealClock clock;
  GrblTurntableOptions options;
  options.drive.axis = 'Q';
  EXPECT_EQ(GrblTurntable::create(options, clock).error().code, ErrorCode::out_of_range);
  options.drive.axis = 'A';
  options.home_mode = "limit";
  EXPECT_EQ(GrblTurntable::create(options, clock).error().code, ErrorCode::out_of_range);
  options.home_mode = "switch";
  options.tolerance = {0.0001};
  const auto fine = GrblTurntable::create(options, clock);
  ASSERT_FALSE(fine);
  EXPECT_THAT(fine.error().message, HasSubstr("wider tolerance"));
}

}  // namespace
}  // namespace scanrig
