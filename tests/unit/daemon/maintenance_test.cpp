#include <gmock/gmock.h>

#include <cmath>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/safety_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using Task = event::MaintenanceRequested::What;

class MaintenanceMode : public Safety {
 protected:
  void ask(Task what, double angle = 0.0, double speed = 5.0) {
    tell(event::MaintenanceRequested{what, {angle}, true, {speed}, requester});
  }
  /// Homed by Reset at the panel: consent to jog.
  void consent() {
    press(Button::reset);
    tell(event::WarningOver{});
    tell(event::Homed{});
  }
  void jog_and_arrive() {
    ask(Task::jog, 5);
    EXPECT_FALSE(refused);
    tell(event::WarningOver{});
    tell(event::Jogged{{5}});
  }

  std::string requester = "user 1000";
};

TEST_F(MaintenanceMode, MaintenanceRefusesJobsAndBlinksAmber) {
  get_ready();
  ask(Task::on);
  EXPECT_EQ(state.machine, MachineState::maintenance);
  EXPECT_EQ(to_string(state.machine), "Halted.Maintenance");
  press(Button::start);
  expect_refused("Maintenance mode is on");
  EXPECT_TRUE(lamps(state, {}, true).amber);
  EXPECT_FALSE(lamps(state, {}, false).amber);
}

TEST_F(MaintenanceMode, MaintenanceBeginsOnlyWhenIdle) {
  begin_scan();
  ask(Task::on);
  EXPECT_TRUE(refused);
  ask(Task::pulse);
  expect_refused("off");
}

TEST_F(MaintenanceMode, AJogNeedsHomeAndSomebodyAtThePanelOrAGuard) {
  start_up();
  ask(Task::on);
  ask(Task::jog, 5);
  expect_refused("panel");
  rules.guard = true;
  ask(Task::jog, 5);
  expect_refused("not homed");
  rules.guard = false;
  press(Button::reset);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  tell(event::WarningOver{});
  EXPECT_NE(asked_for<action::Home>(), nullptr);
  tell(event::Homed{});
  EXPECT_EQ(state.machine, MachineState::maintenance);
  ask(Task::jog, 5);
  EXPECT_FALSE(refused);
  EXPECT_EQ(asked_for<action::Jog>(), nullptr) << "first the warning";
  tell(event::WarningOver{});
  ASSERT_NE(asked_for<action::Jog>(), nullptr);
  EXPECT_EQ(asked_for<action::Jog>()->angle.value, 5);
  tell(event::Jogged{{5.01}});
  EXPECT_EQ(state.activity, Activity::none);
  EXPECT_THAT(state.cause, HasSubstr("5.010"));
}

TEST_F(MaintenanceMode, AJogWithAnOpenGuardOrTooFastIsRefused) {
  rules.guard = true;
  get_ready();
  ask(Task::on);
  ask(Task::jog, 5, 10.1);
  expect_refused("at most 10");
  ask(Task::jog, 5, 0);
  expect_refused("at most 10");
  ask(Task::jog, std::nan(""));
  expect_refused("angle");
  tell(event::GuardChanged{false});
  ask(Task::jog, 5);
  expect_refused("guard is open");
}

TEST_F(MaintenanceMode, RemoteHomingInMaintenanceFollowsTheSameRule) {
  start_up();
  ask(Task::on);
  ask(Task::home);
  expect_refused("disabled");
  allow_remote();
  ask(Task::home);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
}

TEST_F(MaintenanceMode, WhoMovedSomethingInMaintenanceMustResetAfterwards) {
  rules.guard = true;
  get_ready();
  ask(Task::on);
  ask(Task::jog, 5);
  tell(event::WarningOver{});
  tell(event::Jogged{{5}});
  ask(Task::off);
  EXPECT_EQ(state.machine, MachineState::halted);
  press(Button::start);
  EXPECT_TRUE(refused);
}

TEST_F(MaintenanceMode, WhoMovedNothingIsReadyAgain) {
  get_ready();
  ask(Task::on);
  ask(Task::pulse);
  EXPECT_NE(asked_for<action::Pulse>(), nullptr);
  tell(event::Pulsed{});
  ask(Task::lamp_test);
  EXPECT_NE(asked_for<action::TestLamps>(), nullptr);
  ask(Task::off);
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(MaintenanceMode, MaintenanceDoesNotClearAFault) {
  begin_scan();
  fault_and_stand();
  ask(Task::on);
  ASSERT_EQ(state.machine, MachineState::maintenance);
  allow_remote();
  ask(Task::home);
  expect_refused("Reset at the panel");
  ask(Task::off);
  EXPECT_EQ(state.machine, MachineState::error);
}

TEST_F(MaintenanceMode, StopEstopAndGuardEndAJog) {
  rules.guard = true;
  const auto jogging = [&] {
    state = {};
    get_ready();
    ask(Task::on);
    ask(Task::jog, 90);
    tell(event::WarningOver{});
  };
  jogging();
  press(Button::stop);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  tell(event::RigFailed{{ErrorCode::stopped, "stopped"}});
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::maintenance);
  ask(Task::jog, 5);
  expect_refused("not homed");
  jogging();
  tell(event::EstopChanged{false});
  EXPECT_EQ(state.machine, MachineState::error);
  jogging();
  tell(event::GuardChanged{false});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

// --- A flash follows the rules of a motion -------------------------------------------------------------------------

TEST_F(MaintenanceMode, APulseNeedsTheEstopTheGuardAndAPanelThatCanBeRead) {
  get_ready();
  ask(Task::on);
  tell(event::GuardChanged{false});
  ask(Task::pulse);
  expect_refused("guard is open");
  tell(event::GuardChanged{true});
  state.estop_ok = false;
  ask(Task::pulse);
  expect_refused("e-stop is pressed");
  state.estop_ok = true;
  state.panel_known = false;
  ask(Task::pulse);
  expect_refused("check the panel");
}

TEST_F(MaintenanceMode, StopEstopGuardAndPanelEndAPulse) {
  const auto pulsing = [&] {
    state = {};
    get_ready();
    ask(Task::on);
    ask(Task::pulse);
    ASSERT_EQ(state.activity, Activity::pulsing);
  };
  const Event faults[] = {event::EstopChanged{false}, event::GuardChanged{false}, event::PanelFailed{kNoReply}};
  for (const auto& fault : faults) {
    pulsing();
    tell(fault);
    EXPECT_EQ(state.machine, MachineState::error) << fault.index();
    EXPECT_NE(asked_for<action::StopRig>(), nullptr) << fault.index();
  }
  pulsing();
  press(Button::stop);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

// --- Consent to jog ------------------------------------------------------------------------------------------------

TEST_F(MaintenanceMode, ConsentEndsTenMinutesAfterTheLastMotion) {
  start_up();
  ask(Task::on);
  press(Button::reset);
  ASSERT_NE(asked_for<action::EndConsentLater>(), nullptr);
  EXPECT_EQ(asked_for<action::EndConsentLater>()->after, std::chrono::minutes(10));
  tell(event::WarningOver{});
  tell(event::Homed{});
  EXPECT_NE(asked_for<action::EndConsentLater>(), nullptr) << "counted from the end of the motion";
  jog_and_arrive();
  EXPECT_NE(asked_for<action::EndConsentLater>(), nullptr);

  ask(Task::jog, 5);
  tell(event::ConsentTimeout{});
  EXPECT_NE(asked_for<action::EndConsentLater>(), nullptr) << "not in the middle of a motion";
  tell(event::WarningOver{});
  tell(event::Jogged{{5}});
  tell(event::ConsentTimeout{});
  ask(Task::jog, 5);
  expect_refused("at the panel");
  consent();
  jog_and_arrive();
}

TEST_F(MaintenanceMode, ATimeoutOfConsentThatHasEndedOtherwiseChangesNothing) {
  start_up();
  tell(event::ConsentTimeout{});
  EXPECT_EQ(state.machine, MachineState::halted);
  ask(Task::on);
  tell(event::ConsentTimeout{});
  EXPECT_EQ(state.machine, MachineState::maintenance);
  EXPECT_TRUE(actions.empty());
}

TEST_F(MaintenanceMode, AnOpenedGuardEndsTheLeaveToJogUntilResetAtThePanel) {
  rules.guard = true;
  get_ready();
  ask(Task::on);
  jog_and_arrive();
  tell(event::GuardChanged{false});
  tell(event::GuardChanged{true});
  ask(Task::jog, 5);
  expect_refused("at the panel");
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Reset at the panel"));
  consent();
  jog_and_arrive();
  tell(event::GuardChanged{false});
  tell(event::GuardChanged{true});
  ask(Task::jog, 5);
  expect_refused("at the panel");
}

TEST_F(MaintenanceMode, ConsentIsForTheRequesterThatSwitchedMaintenanceOn) {
  start_up();
  ask(Task::on);
  consent();
  jog_and_arrive();
  requester = "192.0.2.7";
  ask(Task::jog, 5);
  expect_refused("who switched maintenance on");
  requester = "user 1000";
  jog_and_arrive();
}

TEST_F(MaintenanceMode, ConsentEndsWithMaintenance) {
  start_up();
  ask(Task::on);
  consent();
  ask(Task::off);
  requester = "192.0.2.7";
  ask(Task::on);
  ask(Task::jog, 5);
  expect_refused("at the panel");
}

TEST_F(MaintenanceMode, BehindAGuardThatStayedClosedAnyEngineerMayJog) {
  rules.guard = true;
  get_ready();
  ask(Task::on);
  requester = "192.0.2.7";
  jog_and_arrive();
}

}  // namespace
}  // namespace scanrig
