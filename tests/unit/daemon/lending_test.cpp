// The devices are lent to setup: from maintenance only, the rig seen stopped, and nothing moves until they are back.
#include <gmock/gmock.h>

#include "daemon/rig/devices.h"
#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using Task = event::MaintenanceRequested::What;
using Why = event::ReloadRequested::Why;

class Lending : public Station {
 protected:
  void lend() { tell(event::ReloadRequested{.why = Why::lend}); }
  void expect_refused(const std::string& why) {
    lend();
    ASSERT_TRUE(refused);
    EXPECT_THAT(refused->message, HasSubstr(why));
    EXPECT_TRUE(actions.empty());
    EXPECT_FALSE(state.reloading);
  }
  /// As ControlLoop begins it.
  void begin_lent() {
    state = {};
    rules.lent = true;
    state.machine = MachineState::maintenance;
    state.maintenance.emplace();
  }
};

TEST_F(Lending, NeedsMaintenanceAndARigAtRest) {
  expect_refused("switch maintenance on first");
  get_ready();
  expect_refused("switch maintenance on first");
  tell(event::MaintenanceRequested{.what = Task::on});
  tell(event::MaintenanceRequested{.what = Task::pulse});
  expect_refused("busy (pulsing)");
}

TEST_F(Lending, IsRefusedDuringAScan) {
  begin_scan();
  expect_refused("switch maintenance on first");
  tell(event::MaintenanceRequested{.what = Task::on});
  EXPECT_TRUE(refused);
  expect_refused("switch maintenance on first");
}

TEST_F(Lending, IsRefusedWhileAModelIsMade) {
  get_ready();
  tell(event::MaintenanceRequested{.what = Task::on});
  tell(event::ReloadRequested{.still_doing = "job a is being reconstructed", .why = Why::lend});
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->message, HasSubstr("job a is being reconstructed"));
}

TEST_F(Lending, EndsWithTheRigSeenStopped) {
  get_ready();
  tell(event::MaintenanceRequested{.what = Task::on});
  lend();
  EXPECT_FALSE(refused);
  EXPECT_TRUE(asked_for<action::StopRig>());
  EXPECT_FALSE(state.finished);
  tell(event::Stopped{});
  EXPECT_TRUE(state.finished);
  EXPECT_TRUE(state.reloading);
  EXPECT_FALSE(state.may_be_moving);
}

TEST_F(Lending, DoesNotClearALatch) {
  get_ready();
  tell(event::EstopChanged{false});
  tell(event::Stopped{});
  tell(event::MaintenanceRequested{.what = Task::on});
  lend();
  tell(event::Stopped{});
  EXPECT_TRUE(state.finished);
  EXPECT_TRUE(state.latch);
}

TEST_F(Lending, NothingButStopIsObeyedMeanwhile) {
  begin_lent();
  for (const auto button : {Button::start, Button::reset}) {
    press(button);
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->message, "Setup has the devices: end it first.");
  }
  for (const auto what : {Task::on, Task::off, Task::home, Task::jog, Task::pulse, Task::lamp_test}) {
    tell(event::MaintenanceRequested{.what = what, .speed = {5}});
    ASSERT_TRUE(refused);
    EXPECT_TRUE(actions.empty());
  }
  lend();
  EXPECT_TRUE(refused);
  tell(event::ReloadRequested{});
  EXPECT_TRUE(refused);
  press(Button::stop, Origin::remote);
  EXPECT_FALSE(refused);
  EXPECT_TRUE(asked_for<action::StopRig>());
}

TEST_F(Lending, AnAbsentPanelIsNoFaultMeanwhile) {
  begin_lent();
  tell(event::PanelFailed{{ErrorCode::busy, "panel: lent to setup"}});
  EXPECT_EQ(state.machine, MachineState::maintenance);
  EXPECT_FALSE(state.latch);
  EXPECT_EQ(describe(state, rules).sentence, "Setup has the devices: nothing moves, no jobs.");
}

TEST_F(Lending, TheDevicesComeBackAlsoWhileStopIsCarriedOut) {
  begin_lent();
  press(Button::stop);
  tell(event::ReloadRequested{.why = Why::give_back});
  EXPECT_FALSE(refused);
  tell(event::Stopped{});
  EXPECT_TRUE(state.finished);
  EXPECT_TRUE(state.reloading);
}

TEST_F(Lending, NothingCanBeGivenBackThatIsNotLent) {
  get_ready();
  tell(event::ReloadRequested{.why = Why::give_back});
  EXPECT_TRUE(refused);
}

TEST_F(Lending, ATableNotSeenStoppedIsSaidToMove) {
  begin_lent();
  press(Button::stop);
  tell(event::StopFailed{{ErrorCode::timeout, "no reply"}});
  EXPECT_TRUE(state.may_be_moving);
  EXPECT_EQ(state.machine, MachineState::error);
}

TEST(LentDevices, DoNothingButStop) {
  int stops = 0;
  Result<void> outcome = fail(ErrorCode::timeout, "not seen");
  LentDevices lent([&] {
    ++stops;
    return outcome;
  });
  const auto devices = lent.devices();
  const Deadline soon{};
  EXPECT_EQ(devices.turntable.home(soon).error().code, ErrorCode::busy);
  EXPECT_EQ(devices.turntable.rotate_to({1}, soon).error().code, ErrorCode::busy);
  EXPECT_EQ(devices.projector.fire(Light::pattern, soon).error().code, ErrorCode::busy);
  EXPECT_EQ(devices.camera.capture_preview(soon).error().code, ErrorCode::busy);
  EXPECT_EQ(devices.panel.wait_change({}, soon).error().code, ErrorCode::busy);
  EXPECT_EQ(stops, 0);
  EXPECT_FALSE(devices.turntable.stop(soon));
  EXPECT_FALSE(devices.turntable.stop(soon)) << "until it is seen stopped, it is stopped again";
  outcome = {};
  EXPECT_TRUE(devices.turntable.stop(soon));
  EXPECT_TRUE(devices.turntable.stop(soon));
  EXPECT_EQ(stops, 3);
}

}  // namespace
}  // namespace scanrig
