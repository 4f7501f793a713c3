#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

class AskedToReload : public Station {
 protected:
  void expect_refused(const std::string& why) {
    const auto before = state.machine;
    tell(event::ReloadRequested{});
    ASSERT_TRUE(refused);
    EXPECT_THAT(refused->message, HasSubstr(why));
    EXPECT_TRUE(actions.empty());
    EXPECT_EQ(state.machine, before);
    EXPECT_FALSE(state.reloading);
  }
};

TEST_F(AskedToReload, AnIdleStationStopsTheRigAndEndsWhenItIsSeenStanding) {
  get_ready();
  tell(event::ReloadRequested{});
  EXPECT_FALSE(refused);
  EXPECT_TRUE(asked_for<action::StopRig>());
  EXPECT_FALSE(state.finished);
  EXPECT_THAT(describe(state, rules).sentence, HasSubstr("Reloading the configuration"));
  press(Button::start);
  EXPECT_TRUE(refused);
  tell(event::Stopped{});
  EXPECT_TRUE(state.finished);
  EXPECT_TRUE(state.reloading);
}

TEST_F(AskedToReload, AStationThatIsHaltedDoesSoToo) {
  start_up();
  tell(event::ReloadRequested{});
  EXPECT_TRUE(state.reloading);
}

TEST_F(AskedToReload, NothingThatIsBeingDoneIsDisturbed) {
  expect_refused("Preoperational");
  start_up();
  press(Button::reset);
  expect_refused("Operational.Initialized, warning");
  tell(event::WarningOver{});
  expect_refused("homing");
  tell(event::Homed{});
  press(Button::start);
  expect_refused("Operational.SingleExecution");
  tell(event::JobStarted{"job", 0, 0});
  tell(event::WarningOver{});
  take_and_store_all(0);
  tell(event::PoseStored{"job", 0});
  expect_refused("waiting_for_flip");
}

TEST_F(AskedToReload, AReconstructionIsNotDisturbedEither) {
  get_ready();
  tell(event::ReloadRequested{"job 7 is being reconstructed"});
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->message, HasSubstr("job 7 is being reconstructed"));
}

TEST_F(AskedToReload, AnEngineerKeepsTheRig) {
  get_ready();
  tell(event::MaintenanceRequested{event::MaintenanceRequested::What::on});
  expect_refused("Maintenance");
}

TEST_F(AskedToReload, ALatchedFaultIsNotGotRidOf) {
  get_ready();
  tell(event::EstopChanged{false});
  tell(event::Stopped{});
  tell(event::EstopChanged{true});
  expect_refused("press Reset");
  EXPECT_TRUE(state.latch);
}

TEST_F(AskedToReload, AShutdownThatComesMeanwhileWins) {
  get_ready();
  tell(event::ReloadRequested{});
  tell(event::Shutdown{});
  EXPECT_FALSE(state.reloading);
  tell(event::Stopped{});
  EXPECT_TRUE(state.finished);
  expect_refused("the service is ending");
}

}  // namespace
}  // namespace scanrig
