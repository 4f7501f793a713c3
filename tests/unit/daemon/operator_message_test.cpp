#include "daemon/station/operator_message.h"

#include <gmock/gmock.h>

#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using Task = event::MaintenanceRequested::What;

class StationWords : public Station {
 protected:
  StationWords() { rules.guard = true; }
  std::string next_action() const { return describe(state, rules).next_action; }
  void see(bool part) {
    event::InputsRead seen{};
    seen.inputs.part_present = part;
    tell(seen);
  }
  /// The first of two parts is scanned and is still on the table.
  void wait_for_part() {
    rules.recipes["default"] = {.poses = 1, .views = 4, .start_on_part = true};
    get_ready();
    for (const char* id : {"job", "next"}) know(queued(id, id == std::string("job") ? 1 : 2, rules.recipes["default"]));
    see(true);
    press(Button::start);
    tell(event::JobStarted{"job", 0, 0});
    tell(event::WarningOver{});
    take_and_store_all(0);
    tell(event::PoseStored{"job", 0});
    ASSERT_EQ(state.activity, Activity::waiting_for_part);
  }
};

TEST_F(StationWords, StartIsAskedForOnlyWithWhatItNeeds) {
  get_ready();
  EXPECT_EQ(next_action(), "Put a part on the table, then press Start.");
  tell(event::GuardChanged{false});
  EXPECT_EQ(next_action(), "Put a part on the table, close the guard, then press Start.");
  tell(event::DevicesChecked{{{"camera", Error{ErrorCode::not_found, "unplugged"}}}});
  EXPECT_EQ(next_action(),
            "Check the camera: no response. Put a part on the table, close the guard, then press Start.");
}

TEST_F(StationWords, TheFlipIsDoneWithTheGuardClosedAgain) {
  reach_flip();
  tell(event::GuardChanged{false});
  EXPECT_EQ(next_action(),
            "Turn the part over so that its underside faces the cameras, close the guard, then press Start.");
}

TEST_F(StationWords, ALineSaysWhatItWaitsFor) {
  wait_for_part();
  EXPECT_EQ(next_action(), "Remove the part, then load the next one.");
  tell(event::GuardChanged{false});
  EXPECT_EQ(next_action(), "Remove the part, then load the next one, then close the guard.");
  see(false);
  EXPECT_EQ(next_action(), "Load the next part, then close the guard.");
  see(true);
  EXPECT_EQ(next_action(), "Close the guard: the queue continues.");
  tell(event::DevicesChecked{{{"camera", Error{ErrorCode::not_found, "unplugged"}}}});
  EXPECT_EQ(next_action(), "Check the camera: no response. Close the guard: the queue continues.");
  tell(event::GuardChanged{true});
  EXPECT_EQ(next_action(), "Check the camera: no response. Wait: the queue continues.");
  tell(event::QuietHours{true});
  EXPECT_EQ(next_action(), "Quiet hours: the queue continues when they end.");
}

TEST_F(StationWords, MaintenanceSaysHowToMoveAndHowToGoOn) {
  start_up();
  tell(event::MaintenanceRequested{.what = Task::on});
  EXPECT_EQ(next_action(), "Press Reset at the panel to home the table, or switch maintenance off.");
  tell(event::GuardChanged{false});
  EXPECT_EQ(next_action(),
            "Close the guard, then press Reset at the panel to home the table, or switch maintenance off.");
  tell(event::GuardChanged{true});
  press(Button::reset);
  EXPECT_EQ(next_action(), "Keep clear.");
  tell(event::WarningOver{});
  tell(event::Homed{});
  EXPECT_EQ(next_action(), "Jog the table, or switch maintenance off.");
}

TEST_F(StationWords, WithoutAGuardMaintenanceAsksForSomebodyAtThePanel) {
  rules.guard = false;
  get_ready();
  tell(event::MaintenanceRequested{.what = Task::on});
  EXPECT_EQ(next_action(), "Press Reset at the panel to home the table, or switch maintenance off.");
}

TEST_F(StationWords, AGuardThatHomesTheTableIsNotClosedUnawares) {
  rules.auto_home = true;
  tell(event::PanelFound{true, false});
  tell(event::Stopped{});
  EXPECT_EQ(next_action(), "Keep clear, then close the guard: the table homes.");
  tell(event::GuardChanged{true});
  EXPECT_EQ(state.activity, Activity::warning);
}

TEST_F(StationWords, ResetIsAskedForOnlyWithWhatItNeeds) {
  start_up();
  tell(event::EstopChanged{false});
  tell(event::Stopped{});
  tell(event::GuardChanged{false});
  EXPECT_EQ(next_action(), "Release the e-stop, close the guard, then press Reset at the panel.");
  tell(event::EstopChanged{true});
  tell(event::GuardChanged{true});
  EXPECT_EQ(next_action(), "Fix the cause, then press Reset at the panel.");
}

TEST_F(StationWords, WhileADevicesFailureMayBeTheEstopNobodyIsToldToReset) {
  get_ready();
  tell(event::RigFailed{Error{ErrorCode::io, "no answer"}});
  tell(event::Stopped{});
  EXPECT_EQ(next_action(), "Wait: checking for an e-stop.");
  press(Button::reset);
  EXPECT_TRUE(refused);
}

}  // namespace
}  // namespace scanrig
