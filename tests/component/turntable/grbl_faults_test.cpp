#include <gmock/gmock.h>

#include <algorithm>

#include "tests/component/turntable/grbl_bench.h"

namespace scanrig {
namespace {

using sim::wire::WireFault;
using sim::wire::WireFrame;
using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint8_t kReport = '?', kLine = 'G';

std::string text_of(const WireFrame& frame) { return {frame.bytes.begin(), frame.bytes.end()}; }
bool is_move(const WireFrame& frame) { return frame.from_master && text_of(frame).starts_with("G"); }
bool is_hold(const WireFrame& frame) { return frame.from_master && text_of(frame) == "!"; }
bool is_report(const WireFrame& frame) { return frame.from_master && text_of(frame) == "?"; }

class GrblFaults : public testing::Test {
 protected:
  static void slow(GrblTurntableOptions& options, sim::wire::GrblSettings&) { options.speed = {450}; }

  Deadline within(milliseconds time) { return Deadline::after(bench_->clock(), time); }
  Result<void> home() { return bench_->turntable().home(within(milliseconds(5000))); }
  Result<Move> rotate_to(double deg) { return bench_->turntable().rotate_to(Degrees{deg}, within(milliseconds(3000))); }

  void start(const GrblBench::Change& change = [](auto&, auto&) {}) {
    bench_.reset();
    bench_ = std::make_unique<GrblBench>(change);
  }
  void start_at_zero(const GrblBench::Change& change = [](auto&, auto&) {}) {
    start(change);
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(0);
    ASSERT_TRUE(moved) << moved.error().message;
    bench_->server().clear_log();
  }
  void expect_rest(double by_deg) {
    for (const auto by = within(milliseconds(2000)); bench_->seen_moving() && !by.expired(bench_->clock());) {
      bench_->clock().sleep_for(milliseconds(2));
    }
    EXPECT_FALSE(bench_->seen_moving());
    EXPECT_LT(bench_->seen_deg(), by_deg);
  }
  void expect_home_is_needed_and_helps() {
    const auto refused = rotate_to(10);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::not_homed) << refused.error().message;
    const auto homed = home();
    ASSERT_TRUE(homed) << homed.error().message;
    const auto moved = rotate_to(10);
    ASSERT_TRUE(moved) << moved.error().message;
  }
  auto moves_sent() {
    const auto log = bench_->server().log();
    return std::ranges::count_if(log, is_move);
  }

  std::unique_ptr<GrblBench> bench_ = std::make_unique<GrblBench>();
};

struct Spoiled {
  const char* name;
  WireFault fault;
  ErrorCode code;
  bool hears_stop;
};

class GrblSpoiledAnswers : public GrblFaults, public testing::WithParamInterface<Spoiled> {};

TEST_P(GrblSpoiledAnswers, EndInTheirErrorWithinTheDeadlineWithTheTableAtRest) {
  const Spoiled& spoiled = GetParam();
  start_at_zero(slow);
  bench_->when_moving([&] { bench_->server().inject(spoiled.fault); });
  const auto began = bench_->clock().now();
  const auto moved = rotate_to(175);
  EXPECT_LT(bench_->clock().now() - began, milliseconds(3000));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, spoiled.code) << moved.error().message;
  EXPECT_THAT(moved.error().message, HasSubstr(spoiled.hears_stop ? "told to stop" : "may be moving"));
  bench_->server().clear_faults();
  if (!spoiled.hears_stop) {
    // The first thing the controller hears when it listens again.
    bench_->server().clear_log();
    EXPECT_TRUE(bench_->turntable().status(within(milliseconds(2000))));
    ASSERT_FALSE(bench_->server().log().empty());
    EXPECT_TRUE(is_hold(bench_->server().log().front()));
  }
  expect_rest(spoiled.hears_stop ? 174.0 : 176.0);
  expect_home_is_needed_and_helps();
}

INSTANTIATE_TEST_SUITE_P(
    All, GrblSpoiledAnswers,
    testing::Values(Spoiled{"Silent", {WireFault::Kind::deaf}, ErrorCode::timeout, false},
                    Spoiled{"AnswersLost", {WireFault::Kind::answer_lost, -1, kReport}, ErrorCode::timeout, true},
                    Spoiled{"Late", {WireFault::Kind::late, -1, kReport, milliseconds(50)}, ErrorCode::timeout, true},
                    Spoiled{"Damaged", {WireFault::Kind::wrong_crc, -1, kReport}, ErrorCode::protocol, true},
                    Spoiled{"CutShort", {WireFault::Kind::cut_short, -1, kReport}, ErrorCode::timeout, true},
                    Spoiled{
                        "EarlierAnswers", {WireFault::Kind::earlier_answer, -1, kReport}, ErrorCode::protocol, true}),
    [](const auto& spoiled) { return spoiled.param.name; });

TEST_F(GrblFaults, OneDamagedReportIsAskedForAgainAndCounted) {
  start_at_zero();
  const auto before = bench_->turntable().statistics();
  bench_->server().inject({WireFault::Kind::wrong_crc, 1, kReport});
  ASSERT_TRUE(rotate_to(45));
  const auto after = bench_->turntable().statistics();
  EXPECT_EQ(after.corrupt - before.corrupt, 1u);
  EXPECT_GE(after.retries - before.retries, 1u);
}

TEST_F(GrblFaults, AMoveWhoseAnswerIsLostIsNotSentAgainOnceSeenRunning) {
  start_at_zero(slow);
  bench_->server().inject({WireFault::Kind::answer_lost, 1, kLine});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(moved->measured.value, 45, 0.05);
  EXPECT_EQ(moves_sent(), 1);
}

TEST_F(GrblFaults, AMoveThatWasNotHeardIsSentAgainOnlyAfterReading) {
  start_at_zero();
  bench_->server().inject({WireFault::Kind::deaf, 1, kLine});
  const auto moved = rotate_to(45);
  ASSERT_TRUE(moved) << moved.error().message;
  ASSERT_EQ(moves_sent(), 2);
  const auto log = bench_->server().log();
  const auto first = std::ranges::find_if(log, is_move);
  const auto second = std::find_if(first + 1, log.end(), is_move);
  EXPECT_TRUE(std::any_of(first, second, is_report));
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
  bench_->when_moving([&] { bench_->server().vanish(); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::io) << moved.error().message;
  EXPECT_THAT(moved.error().message, HasSubstr("may be moving"));
  EXPECT_FALSE(bench_->turntable().status(within(milliseconds(500))));
  bench_->server().clear_log();
  ASSERT_TRUE(bench_->server().come_back());
  const auto back = bench_->turntable().status(within(milliseconds(500)));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_FALSE(back->homed);
  EXPECT_TRUE(is_hold(bench_->server().log().front()));
  expect_rest(180.0);
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
  bench_->when_moving([&] { bench_->drive().raise_alarm(1); });
  const auto moved = rotate_to(90);
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device_alarm) << moved.error().message;
  EXPECT_THAT(moved.error().message, HasSubstr("a limit switch was hit"));
  expect_rest(89.0);
  const auto status = bench_->turntable().status(within(milliseconds(1000)));
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_THAT(status->alarm, HasSubstr("a limit switch was hit"));
  const auto homed = home();
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().code, ErrorCode::device_alarm);
  ASSERT_TRUE(bench_->turntable().reset_alarm(within(milliseconds(1000))));
  expect_home_is_needed_and_helps();
}

TEST_F(GrblFaults, AnAlarmThatStaysIsSaid) {
  start_at_zero();
  bench_->drive().raise_alarm(1, false);
  const auto reset = bench_->turntable().reset_alarm(within(milliseconds(1000)));
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
  // Even one that is not locked after a restart and would take the next move.
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
  EXPECT_TRUE(bench_->turntable().reset_alarm(within(milliseconds(1000))));
  EXPECT_TRUE(home());
  for (const auto& frame : bench_->server().log()) {
    if (frame.from_master) {
      EXPECT_THAT(text_of(frame), Not(HasSubstr("$X")));
    }
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
