#include <thread>

#include "tests/system/safety/tool_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr int kDevice = 5, kRefused = 6, kStopped = 10;

/// The tools that move obey the daemon's rules: e-stop, guard, panel, lamp, and an end that is always a standstill.
class ToolRules : public testing::Test {
 protected:
  void expect_refused(int code, const std::string& why) {
    for (const Tool& tool : {kHome, kMove}) {
      EXPECT_EQ(bench.run(tool), code) << bench.output();
      EXPECT_THAT(bench.output(), HasSubstr(why));
    }
    EXPECT_TRUE(rig.moves({}).empty());
  }
  /// A moving tool is stopped by `event`, and reports it.
  void expect_stopped_by(const Tool& tool, const std::function<void()>& event, int code, const std::string& why) {
    bench.start(tool);
    ASSERT_TRUE(rig.wait_moving()) << bench.output();
    const auto then = rig.clock.now();
    event();
    ASSERT_TRUE(rig.wait_for([&] { return !rig.stops(then).empty(); }));
    EXPECT_EQ(bench.wait(), code) << bench.output();
    EXPECT_THAT(bench.output(), HasSubstr(why));
    EXPECT_FALSE(bench.is_moving());
    EXPECT_TRUE(rig.moves(rig.stops(then).front()).empty());
    EXPECT_LT(rig.stops(then).front() - then, kSlowness * milliseconds(250));
  }

  ToolBench bench;
  WireRig& rig = bench.rig;
};

TEST_F(ToolRules, APressedEstopAnOpenGuardAndAPanelWithoutReplyRefuse) {
  rig.set_estop(false);
  expect_refused(kRefused, "e-stop: pressed");
  rig.set_estop(true);
  rig.lines->set("GUARD_OK", false);
  expect_refused(kRefused, "guard: open");
  EXPECT_EQ(bench.run(kDoctor), kRefused) << bench.output();
  rig.lines.reset();
  expect_refused(kDevice, "panel");
  EXPECT_EQ(bench.guardian(), 0) << "it has ended with the tool";
}

TEST_F(ToolRules, TheLampWarnsForTwoSecondsBeforeTheFirstMove) {
  bench.start(kMove);
  ASSERT_TRUE(rig.wait_for([&] { return rig.lamp("AMBER"); }));
  const auto lit = rig.clock.now();
  EXPECT_EQ(bench.wait(), 0) << bench.output();
  ASSERT_FALSE(rig.moves({}).empty());
  EXPECT_GE(rig.moves({}).front() - lit, seconds(2) - milliseconds(5));
  EXPECT_FALSE(rig.lamp("AMBER") || rig.lamp("BUSY") || rig.lamp("RED"));
}

TEST_F(ToolRules, AnEstopInTheWarningOrInTheMoveEndsIt) {
  bench.start(kHome);
  ASSERT_TRUE(rig.wait_for([&] { return rig.lamp("AMBER"); }));
  rig.set_estop(false);
  EXPECT_EQ(bench.wait(), kStopped) << bench.output();
  EXPECT_TRUE(rig.moves({}).empty());
  rig.set_estop(true);
  expect_stopped_by(
      kHome, [&] { rig.set_estop(false); }, kStopped, "e-stop: pressed");
  EXPECT_TRUE(rig.lamp("RED"));
}

TEST_F(ToolRules, AGuardThatIsOpenedStopsTheTable) {
  expect_stopped_by(
      kMove, [&] { rig.lines->set("GUARD_OK", false); }, kStopped, "guard: opened");
}

TEST_F(ToolRules, TheStopButtonStopsTheTable) {
  expect_stopped_by(
      kHome, [&] { rig.lines->set("STOP", true); }, kStopped, "Stop button");
}

TEST_F(ToolRules, APanelThatIsLostStopsTheTable) {
  expect_stopped_by(
      kHome, [&] { rig.lines.reset(); }, kDevice, "panel");
}

TEST_F(ToolRules, AnEstopStopsTheDoctorsOwnMoveOfTheDriveToo) {
  bench.start(kDoctor);
  // Its second homing command is the first that goes past Turntable: home, quarter turn, home, step aside, seek.
  ASSERT_TRUE(rig.wait_for([&] { return rig.moves({}).size() >= 5; })) << bench.output();
  ASSERT_TRUE(rig.wait_moving());
  const auto pressed = rig.clock.now();
  rig.set_estop(false);
  EXPECT_EQ(bench.wait(), kStopped) << bench.output();
  EXPECT_THAT(bench.output(), HasSubstr("e-stop: pressed"));
  EXPECT_FALSE(bench.is_moving());
  ASSERT_FALSE(rig.stops(pressed).empty());
  EXPECT_LT(rig.stops(pressed).front() - pressed, kSlowness * milliseconds(250));
}

TEST_F(ToolRules, AHangupStopsTheTable) {
  expect_stopped_by(
      kHome, [&] { bench.signal(SIGHUP); }, kStopped, "stopped");
}

TEST_F(ToolRules, AToolThatIsSuspendedInAMoveIsEndedByItsGuardian) {
  bench.start(kDoctor);
  ASSERT_TRUE(rig.wait_for([&] { return rig.moves({}).size() >= 5; })) << bench.output();
  ASSERT_TRUE(rig.wait_moving());
  const auto suspended = rig.clock.now();
  bench.signal(SIGSTOP);
  ASSERT_TRUE(rig.wait_for([&] { return !rig.stops(suspended).empty(); }));
  EXPECT_EQ(bench.wait(), -1);
  EXPECT_TRUE(rig.wait_for([&] { return !bench.is_moving() && rig.lamp("RED"); }));
  EXPECT_THAT(bench.output(), HasSubstr("does not run any more"));
}

TEST_F(ToolRules, AToolWhoseGuardianIsKilledStopsTheTable) {
  expect_stopped_by(
      kHome,
      [&] {
        const pid_t guardian = bench.guardian();
        ASSERT_GT(guardian, 0);
        ::kill(guardian, SIGKILL);
      },
      kDevice, "motion guardian");
}

TEST_F(ToolRules, ADriveThatDoesNotRespondIsNotCalledStoppedAndGetsStopUntilItResponds) {
  bench.start(kHome);
  ASSERT_TRUE(rig.wait_moving());
  rig.serial->inject({sim::wire::WireFault::Kind::request_lost});
  ASSERT_TRUE(rig.wait_for([&] { return bench.output().find("Keep clear") != std::string::npos; })) << bench.output();
  rig.serial->clear_faults();
  const auto back = rig.clock.now();
  EXPECT_EQ(bench.wait(), kDevice) << bench.output();
  EXPECT_FALSE(rig.stops(back).empty());
  EXPECT_FALSE(bench.is_moving());
  EXPECT_TRUE(rig.lamp("RED"));
}

}  // namespace
}  // namespace scanrig
