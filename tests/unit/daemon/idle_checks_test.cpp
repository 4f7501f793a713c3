#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/safety_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// Reports of the drive without a requested motion, and calls that hang.
class IdleChecks : public Safety {
 protected:
  void drive_reports(bool is_moving, const std::string& alarm = {}) {
    tell(event::DevicesChecked{{{"turntable"}, {"projector"}, {"camera"}}, event::DriveReport{is_moving, alarm}});
  }
  void hang(const std::string& device, const std::string& call = "collect") {
    tell(event::HungCallChanged{HungCall{device, call, std::chrono::milliseconds(800)}});
  }
  void expect_latched_fault(const std::string& cause, const std::string& device) {
    EXPECT_EQ(state.machine, MachineState::error);
    EXPECT_TRUE(state.latch);
    EXPECT_EQ(state.fault_device, device);
    EXPECT_THAT(state.cause, HasSubstr(cause));
  }
};

TEST_F(IdleChecks, ATableThatMovesWithoutARequestIsStoppedAndAFault) {
  get_ready();
  drive_reports(true);
  expect_latched_fault("The table moved without a request.", "turntable");
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

TEST_F(IdleChecks, TheSameBeforeHomingInMaintenanceAndWhileAPartIsAwaited) {
  start_up();
  drive_reports(true);
  expect_latched_fault("moved without a request", "turntable");

  state = {};
  start_up();
  tell(event::MaintenanceRequested{.what = event::MaintenanceRequested::What::on});
  drive_reports(true);
  expect_latched_fault("moved without a request", "turntable");
}

TEST_F(IdleChecks, ATableThatMovesBehindAFaultIsStoppedAndTheFirstCauseStays) {
  begin_scan();
  fault_and_stand();
  drive_reports(true);
  EXPECT_THAT(state.cause, HasSubstr("no reply"));
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

TEST_F(IdleChecks, ATableThatMovesWhileTheObjectIsTurnedOverInterruptsTheJob) {
  reach_flip();
  tell(event::CheckDue{});
  EXPECT_NE(asked_for<action::CheckDevices>(), nullptr) << "a hand is at the table";
  drive_reports(true);
  expect_latched_fault("moved without a request", "turntable");
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
}

TEST_F(IdleChecks, AnAlarmRaisedWhileIdleIsAFaultOnceAnEstopIsRuledOut) {
  get_ready();
  drive_reports(false, "over-current (alarm 0x01)");
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  tell(event::Stopped{});
  tell(event::EstopWindowOver{});
  expect_latched_fault("The drive reports an alarm: over-current (alarm 0x01).", "turntable");
}

TEST_F(IdleChecks, AnAlarmThatAnEstopBroughtIsCalledTheEstop) {
  get_ready();
  drive_reports(false, "no motor power");
  tell(event::EstopChanged{false});
  tell(event::EstopWindowOver{});
  expect_latched_fault("The e-stop was pressed.", "");
}

TEST_F(IdleChecks, AnAlarmFromBeforeTheFirstResetIsLeftToIt) {
  start_up();
  for (int check = 0; check < 3; ++check) {
    drive_reports(false, "position error");
    EXPECT_EQ(state.machine, MachineState::halted);
  }
  press(Button::reset);
  EXPECT_FALSE(refused);
  tell(event::WarningOver{});
  tell(event::Homed{});
  drive_reports(false, "position error");
  EXPECT_EQ(state.machine, MachineState::error) << "homing has cleared it: this is another one";
}

TEST_F(IdleChecks, AnAlarmThatComesBeforeTheFirstResetIsAFault) {
  start_up();
  drive_reports(false);
  drive_reports(false, "position error");
  EXPECT_EQ(state.machine, MachineState::error);
}

TEST_F(IdleChecks, AnAlarmBehindALatchedFaultIsNoOther) {
  get_ready();
  tell(event::EstopChanged{false});
  tell(event::Stopped{});
  drive_reports(false, "no motor power");
  EXPECT_EQ(asked_for<action::StopRig>(), nullptr);
  tell(event::EstopChanged{true});
  drive_reports(false, "no motor power");
  expect_latched_fault("The e-stop was pressed.", "");
  press(Button::reset);
  EXPECT_FALSE(refused) << "Reset clears it";
}

TEST_F(IdleChecks, ACameraThatHangsIsAFaultAndTheTableIsStoppedPastIt) {
  begin_scan();
  hang("camera");
  expect_latched_fault("camera: collect has not returned 0.8 s after its deadline", "camera");
  EXPECT_NE(asked_for<action::StopTableDirectly>(), nullptr);
  EXPECT_EQ(asked_for<action::StopRig>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
}

TEST_F(IdleChecks, ATurntableThatHangsIsStoppedByAnotherProcess) {
  begin_scan();
  hang("turntable", "rotate_to");
  expect_latched_fault("turntable: rotate_to has not returned", "turntable");
  EXPECT_NE(asked_for<action::StopTableOutside>(), nullptr);
  tell(event::StopFailed{kNoReply});
  tell(event::StopRetryDue{});
  EXPECT_NE(asked_for<action::StopTableOutside>(), nullptr) << "again, by the same path";
}

TEST_F(IdleChecks, AStopThatHangsBehindAFaultIsSentByAnotherPath) {
  begin_scan();
  tell(event::EstopChanged{false});
  hang("projector", "dark");
  EXPECT_EQ(state.cause, "The e-stop was pressed.");
  EXPECT_NE(asked_for<action::StopTableDirectly>(), nullptr);
  tell(event::Stopped{});
  EXPECT_EQ(state.activity, Activity::none);
}

TEST_F(IdleChecks, ResetWaitsForTheCallThatHangs) {
  get_ready();
  hang("camera", "ready");
  tell(event::Stopped{});
  press(Button::reset);
  expect_refused("The camera does not respond");
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("the service restarts itself"));
  tell(event::HungCallChanged{});
  EXPECT_NE(asked_for<action::StopRig>(), nullptr) << "evidence by the usual path";
  tell(event::Stopped{});
  press(Button::reset);
  EXPECT_FALSE(refused);
}

TEST_F(IdleChecks, WhatHangsIsOneSentenceThatFits) {
  const auto error = hung_error({"turntable", "limit_speed", std::chrono::milliseconds(10'250)});
  EXPECT_EQ(error.message,
            "turntable: limit_speed has not returned 10.2 s after its deadline; check its cable, the service restarts "
            "itself");
  EXPECT_LE(error.message.size(), 120u);
}

}  // namespace
}  // namespace scanrig
