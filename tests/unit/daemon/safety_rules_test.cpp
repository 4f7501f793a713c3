#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/safety_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

// --- Permission to move the table -----------------------------------------------------------------------------------

TEST_F(Safety, RemoteStartAndResetNeedTheSettingAndAGuardThatIsClosed) {
  start_up();
  press(Button::reset, Origin::remote);
  expect_refused("disabled");
  rules.remote = true;
  press(Button::reset, Origin::remote);
  expect_refused("disabled");
  rules.guard = true;
  tell(event::GuardChanged{false});
  press(Button::reset, Origin::remote);
  expect_refused("guard is open");
  tell(event::GuardChanged{true});
  press(Button::reset, Origin::remote);
  EXPECT_FALSE(refused);
  EXPECT_EQ(state.machine, MachineState::initialized);
}

TEST_F(Safety, ARemoteStartNeedsTheSameWhenReady) {
  get_ready();
  press(Button::start, Origin::remote);
  expect_refused("disabled");
  allow_remote();
  tell(event::GuardChanged{false});
  press(Button::start, Origin::remote);
  expect_refused("guard is open");
  tell(event::GuardChanged{true});
  press(Button::start, Origin::remote);
  EXPECT_FALSE(refused);
}

TEST_F(Safety, AFaultIsResetAtThePanelOnly) {
  allow_remote();
  begin_scan();
  fault_and_stand();
  press(Button::reset, Origin::remote);
  expect_refused("Reset at the panel");
  press(Button::reset);
  EXPECT_EQ(state.machine, MachineState::initialized);
}

TEST_F(Safety, AnEstopIsResetAtThePanelOnlyAndRestartsNothing) {
  allow_remote();
  begin_scan();
  tell(event::EstopChanged{false});
  tell(event::Stopped{});
  tell(event::EstopChanged{true});
  EXPECT_TRUE(actions.empty());
  press(Button::reset, Origin::remote);
  expect_refused("Reset at the panel");
  press(Button::start);
  EXPECT_TRUE(refused);
  press(Button::reset);
  tell(event::WarningOver{});
  EXPECT_NE(asked_for<action::Home>(), nullptr);
  tell(event::Homed{});
  EXPECT_EQ(state.machine, MachineState::ready) << "and an explicit start";
  EXPECT_TRUE(actions.empty());
}

TEST_F(Safety, ThePanelTakesControlOfAScanStartedElsewhere) {
  allow_remote();
  get_ready();
  press(Button::start, Origin::remote);
  press(Button::stop);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

TEST_F(Safety, AfterARestartNothingMovesByItself) {
  tell(event::PanelFound{true, true});
  tell(event::Stopped{});
  tell(event::GuardChanged{false});
  tell(event::GuardChanged{true});
  EXPECT_EQ(state.machine, MachineState::halted);
  EXPECT_TRUE(actions.empty());
}

TEST_F(Safety, WhereConfiguredAClosedGuardHomesAfterARestartWithTheWarning) {
  rules.guard = rules.auto_home = true;
  tell(event::PanelFound{true, false});
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::halted);
  tell(event::GuardChanged{true});
  EXPECT_EQ(state.machine, MachineState::initialized);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  EXPECT_EQ(asked_for<action::Home>(), nullptr);
  tell(event::WarningOver{});
  EXPECT_NE(asked_for<action::Home>(), nullptr);
}

TEST_F(Safety, AClosedGuardHomesAfterARestartOnlyNotAfterAStopOrAFault) {
  rules.guard = rules.auto_home = true;
  start_up();
  ASSERT_EQ(state.machine, MachineState::initialized);
  press(Button::stop);
  tell(event::Stopped{});
  tell(event::GuardChanged{false});
  tell(event::GuardChanged{true});
  EXPECT_EQ(state.machine, MachineState::halted);
  EXPECT_TRUE(actions.empty());
}

TEST_F(Safety, AClosedGuardDoesNotHomeWhileTheEstopIsPressed) {
  rules.guard = rules.auto_home = true;
  tell(event::PanelFound{false, true});
  tell(event::Stopped{});
  tell(event::EstopChanged{true});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_TRUE(actions.empty());
}

TEST_F(Safety, TheGuardOpenedInTheWarningOrWhileHomingStops) {
  for (const bool homing : {false, true}) {
    state = {};
    start_up();
    press(Button::reset);
    if (homing) tell(event::WarningOver{});
    tell(event::GuardChanged{false});
    EXPECT_EQ(state.machine, MachineState::error);
    EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  }
}

// --- A panel that cannot be read ------------------------------------------------------------------------------------

TEST_F(Safety, APanelThatCannotBeReadStopsTheTableAndAllowsNoMotion) {
  begin_scan();
  tell(event::PanelFailed{{ErrorCode::timeout, "panel: no complete reply"}});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  tell(event::Stopped{});
  press(Button::reset);
  expect_refused("check the panel");
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("panel"));
  tell(event::PanelFound{true, true});
  EXPECT_EQ(state.machine, MachineState::error) << "still latched";
  press(Button::reset);
  EXPECT_EQ(state.machine, MachineState::initialized);
}

TEST_F(Safety, APanelThatComesBackWithTheEstopPressedIsStillAnEstop) {
  begin_scan();
  tell(event::PanelFailed{kNoReply});
  tell(event::Stopped{});
  tell(event::PanelFound{false, true});
  press(Button::reset);
  expect_refused("e-stop");
}

TEST_F(Safety, APanelThatIsAbsentAtStartUpStillHasTheTableStopped) {
  tell(event::PanelFailed{{ErrorCode::io, "panel: open /dev/x: no such file"}});
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  EXPECT_EQ(state.machine, MachineState::error);
}

// --- Names of failures ----------------------------------------------------------------------------------------------

TEST_F(Safety, ADeviceThatFailsStopsTheRigAtOnceAndIsNamedAfterTheWindow) {
  begin_scan();
  tell(event::RigFailed{kNoReply});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  EXPECT_NE(asked_for<action::WaitForEstop>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>(), nullptr);
  EXPECT_THAT(state.cause, Not(HasSubstr("no reply")));
  tell(event::EstopWindowOver{});
  EXPECT_EQ(state.cause, "turntable: no reply.");
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_THAT(asked_for<action::CloseJob>()->why.message, HasSubstr("no reply"));
}

TEST_F(Safety, AnEstopWithinTheWindowGivesItsNameToFaultAndJob) {
  begin_scan();
  tell(event::RigFailed{kNoReply});
  tell(event::EstopChanged{false});
  EXPECT_THAT(state.cause, HasSubstr("e-stop"));
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_THAT(asked_for<action::CloseJob>()->why.message, HasSubstr("e-stop"));
  tell(event::EstopWindowOver{});
  EXPECT_THAT(state.cause, HasSubstr("e-stop"));
}

TEST_F(Safety, AnEstopAfterAFaultIsAddedToItsCause) {
  begin_scan();
  tell(event::RigFailed{kNoReply});
  tell(event::EstopWindowOver{});
  tell(event::EstopChanged{false});
  EXPECT_EQ(state.cause, "turntable: no reply. The e-stop was pressed.");
  EXPECT_EQ(state.latch->cause, state.cause);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  tell(event::EstopChanged{true});
  tell(event::EstopChanged{false});
  EXPECT_EQ(state.cause, "turntable: no reply. The e-stop was pressed.") << "once";
}

TEST_F(Safety, AnOpenedGuardIsReportedWithWhatTheRigWasDoing) {
  start_up();
  press(Button::reset);
  tell(event::GuardChanged{false});
  EXPECT_EQ(state.cause, "The guard was opened before the table moved.");
}

TEST_F(Safety, WhatFailsAfterAnEstopDoesNotTakeItsName) {
  begin_scan();
  tell(event::EstopChanged{false});
  tell(event::RigFailed{kNoReply});
  tell(event::StopFailed{kNoReply});
  EXPECT_THAT(state.cause, HasSubstr("e-stop"));
  EXPECT_TRUE(state.may_be_moving);
}

TEST_F(Safety, ResetWaitsForTheNameAndTheLampsSayBusy) {
  begin_scan();
  tell(event::RigFailed{kNoReply});
  tell(event::Stopped{});
  EXPECT_TRUE(lamps(state, {}).busy);
  press(Button::reset);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::busy);
  tell(event::EstopWindowOver{});
  EXPECT_FALSE(lamps(state, {}).busy);
  press(Button::reset);
  EXPECT_FALSE(refused);
}

// --- The table may be moving ----------------------------------------------------------------------------------------

TEST_F(Safety, WhileTheTableMayBeMovingStopIsRepeatedAndResetRefused) {
  begin_scan();
  press(Button::stop);
  tell(event::StopFailed{kNoReply});
  EXPECT_TRUE(state.may_be_moving);
  EXPECT_TRUE(lamps(state, {}).red);
  EXPECT_THAT(describe(state, rules).sentence, HasSubstr("may be moving"));
  EXPECT_NE(asked_for<action::RetryStopLater>(), nullptr);
  press(Button::reset);
  expect_refused("may be moving");
  tell(event::StopRetryDue{});
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  EXPECT_EQ(actions.size(), 1u) << "nothing comes before the stop";
  tell(event::StopFailed{kNoReply});
  EXPECT_NE(asked_for<action::RetryStopLater>(), nullptr);
  tell(event::StopRetryDue{});
  tell(event::Stopped{});
  EXPECT_FALSE(state.may_be_moving);
  press(Button::reset);
  EXPECT_FALSE(refused);
}

TEST_F(Safety, DevicesAreNotAskedBeforeTheTableIsStopped) {
  begin_scan();
  press(Button::stop);
  tell(event::StopFailed{kNoReply});
  tell(event::CheckDue{});
  EXPECT_EQ(asked_for<action::CheckDevices>(), nullptr);
  EXPECT_NE(asked_for<action::CheckLater>(), nullptr);
}

TEST_F(Safety, AShutdownThatCannotStopTheTableEndsAllTheSame) {
  begin_scan();
  tell(event::Shutdown{});
  tell(event::StopFailed{kNoReply});
  EXPECT_TRUE(state.finished);
  EXPECT_TRUE(state.may_be_moving);
  EXPECT_TRUE(lamps(state, {}).red);
}

TEST_F(Safety, ADaemonThatEndsLeavesTheRedLamp) {
  start_up();
  tell(event::Shutdown{});
  tell(event::Stopped{});
  EXPECT_TRUE(lamps(state, {}).red);
}

// --- Absent devices -------------------------------------------------------------------------------------------------

TEST_F(Safety, AnAbsentDeviceLeavesTheRestRunningAndLetsNoJobBegin) {
  start_up();
  tell(event::DevicesChecked{{{"turntable"}, {"camera", Error{ErrorCode::unsupported, "no driver aravis"}}}});
  EXPECT_EQ(state.machine, MachineState::halted);
  press(Button::reset);
  EXPECT_FALSE(refused);
  tell(event::WarningOver{});
  tell(event::Homed{});
  press(Button::start);
  expect_refused("no driver aravis");
  tell(event::DevicesChecked{{{"turntable"}, {"camera"}}});
  EXPECT_NE(asked_for<action::CheckLater>(), nullptr);
  press(Button::start);
  EXPECT_FALSE(refused);
}

TEST_F(Safety, DevicesAreAskedInQuietTimesOnly) {
  get_ready();
  tell(event::CheckDue{});
  EXPECT_NE(asked_for<action::CheckDevices>(), nullptr);
  press(Button::start);
  tell(event::CheckDue{});
  EXPECT_EQ(asked_for<action::CheckDevices>(), nullptr);
  EXPECT_NE(asked_for<action::CheckLater>(), nullptr);
}

TEST_F(Safety, TheOperatorIsToldToSwitchAProjectorThatOnlyAHandCanSwitch) {
  rules.manual_light = true;
  get_ready();
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("projector on"));
  tell(event::EstopChanged{false});
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("projector off"));
}

}  // namespace
}  // namespace scanrig
