#include "daemon/station/transition.h"

#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

TEST_F(Station, StartsUpHaltedOnlyAfterTheTableIsSeenStanding) {
  tell(event::PanelFound{true, true});
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  press(Button::reset);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::busy);
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::halted);
  EXPECT_EQ(state.activity, Activity::none);
}

TEST_F(Station, HomesOnlyAfterResetAndTheWarning) {
  start_up();
  press(Button::start);
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->message, HasSubstr("Press Reset first"));
  press(Button::reset);
  EXPECT_EQ(state.machine, MachineState::initialized);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  EXPECT_EQ(asked_for<action::Home>(), nullptr);
  tell(event::WarningOver{});
  EXPECT_NE(asked_for<action::Home>(), nullptr);
  tell(event::Homed{});
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Station, MovesForAJobOnlyWhenWarnedAndTheFolderIsThere) {
  get_ready();
  press(Button::start);
  EXPECT_NE(asked_for<action::CreateJobs>(), nullptr);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  tell(event::WarningOver{});
  EXPECT_EQ(asked_for<action::TakeView>(), nullptr) << "the job's folder does not exist yet";
  tell(event::JobStarted{"job", 0, 0});
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 0, 0}));
}

TEST_F(Station, TakesViewsAtEqualAngles) {
  begin_scan();
  for (int view = 0; view < 4; ++view) {
    ASSERT_NE(asked_for<action::TakeView>(), nullptr);
    EXPECT_EQ(asked_for<action::TakeView>()->id.view, view);
    EXPECT_DOUBLE_EQ(asked_for<action::TakeView>()->angle.value, 90.0 * view);
    if (view > 0) store(0, view - 1);
    take(0, view);
  }
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_TRUE(asked_for<action::TakeView>()->movement_check) << "a fifth view of four";
  EXPECT_EQ(asked_for<action::TakeView>()->angle.value, 0.0);
}

TEST_F(Station, KeepsAtMostTwoViewsInMemoryOnly) {
  begin_scan();
  take(0, 0);
  EXPECT_NE(asked_for<action::StoreView>(), nullptr);
  EXPECT_NE(asked_for<action::TakeView>(), nullptr) << "one view may be unstored while the table moves on";
  take(0, 1);
  EXPECT_EQ(asked_for<action::TakeView>(), nullptr) << "two are unstored";
  store(0, 0);
  EXPECT_NE(asked_for<action::TakeView>(), nullptr);
}

TEST_F(Station, AsksForTheFlipWhenThePoseIsOnDisk) {
  begin_scan();
  for (int view = 0; view < 4; ++view) {
    take(0, view);
    if (view < 3) store(0, view);
  }
  tell(event::CheckViewTaken{});
  EXPECT_EQ(state.activity, Activity::storing);
  store(0, 3);
  EXPECT_EQ(asked_for<action::FinishPose>(), nullptr) << "the movement check is still missing";
  tell(event::MovementChecked{"job", {.unmoved = true}});
  ASSERT_NE(asked_for<action::FinishPose>(), nullptr);
  EXPECT_FALSE(asked_for<action::FinishPose>()->last);
  EXPECT_EQ(state.activity, Activity::storing) << "not before the manifest says so";
  tell(event::PoseStored{"job", 0});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Turn the part over"));
}

TEST_F(Station, StartMeansContinueAfterTheFlipAndWarnsAgain) {
  reach_flip();
  press(Button::start);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  EXPECT_NE(asked_for<action::ResumeJob>(), nullptr);
  tell(event::WarningOver{});
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 1, 0}));
}

TEST_F(Station, IsReadyForTheNextJobWhenTheLastViewIsOnDisk) {
  reach_flip();
  press(Button::start);
  tell(event::WarningOver{});
  take_and_store_all(1);
  ASSERT_NE(asked_for<action::FinishPose>(), nullptr);
  EXPECT_TRUE(asked_for<action::FinishPose>()->last);
  tell(event::PoseStored{"job", 1});
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_FALSE(state.job);
}

TEST_F(Station, IgnoresStartWhileBusy) {
  begin_scan();
  const auto before = state.job->asked;
  press(Button::start);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::busy);
  EXPECT_TRUE(actions.empty());
  EXPECT_EQ(state.job->asked, before);
}

TEST_F(Station, StopInterruptsTheJobAndEndsHaltedAfterStandstill) {
  begin_scan();
  press(Button::stop);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted) << "only Cancel cancels";
  tell(event::RigFailed{{ErrorCode::stopped, "turntable: stopped"}});
  EXPECT_EQ(state.machine, MachineState::halted) << "a move cut short by Stop is no fault";
  EXPECT_EQ(state.activity, Activity::stopping);
  tell(event::Stopped{});
  EXPECT_EQ(state.activity, Activity::none);
}

TEST_F(Station, AViewThatComesAfterStopIsNotKept) {
  begin_scan();
  press(Button::stop);
  take(0, 0);
  EXPECT_TRUE(actions.empty());
}

TEST_F(Station, StopWhileWaitingForTheFlipNeedsNoHoming) {
  reach_flip();
  press(Button::stop);
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_EQ(state.activity, Activity::none);
}

TEST_F(Station, StopWhenNothingMovesIsSentAllTheSameAndKeepsHome) {
  get_ready();
  for (int press_count = 0; press_count < 2; ++press_count) {
    press(Button::stop);
    EXPECT_FALSE(refused);
    EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  }
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Station, StopWhileShuttingDownIsSentToo) {
  begin_scan();
  tell(event::Shutdown{});
  press(Button::stop);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

TEST_F(Station, ALatchOfAnEarlierProcessNeedsResetAtThePanel) {
  rules.guard = rules.auto_home = rules.remote = true;
  state.latch = Latch{"The e-stop was pressed."};
  state.cause = state.latch->cause;
  start_up();
  EXPECT_EQ(state.machine, MachineState::error) << "a closed guard does not home over a latch";
  EXPECT_EQ(state.cause, "The e-stop was pressed.");
  press(Button::reset, Origin::remote);
  EXPECT_TRUE(refused);
  press(Button::reset);
  EXPECT_FALSE(state.latch);
  EXPECT_EQ(state.machine, MachineState::initialized);
}

TEST_F(Station, AFaultLatchesUntilReset) {
  begin_scan();
  tell(event::RigFailed{{ErrorCode::stalled, "turntable: stalled at 12 deg"}});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  tell(event::EstopWindowOver{});
  EXPECT_THAT(state.cause, HasSubstr("stalled at 12 deg"));
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::error);
  press(Button::start);
  EXPECT_TRUE(refused);
  EXPECT_EQ(state.machine, MachineState::error);
  press(Button::reset);
  EXPECT_EQ(state.machine, MachineState::initialized);
}

TEST_F(Station, TheFirstFaultIsTheOneShown) {
  begin_scan();
  tell(event::RigFailed{{ErrorCode::stalled, "turntable: stalled"}});
  tell(event::PanelFailed{{ErrorCode::io, "panel: gone"}});
  tell(event::EstopWindowOver{});
  EXPECT_EQ(state.cause, "turntable: stalled.");
}

TEST_F(Station, TheEstopOutranksTheFaultItCauses) {
  begin_scan();
  tell(event::RigFailed{{ErrorCode::timeout, "turntable: no reply"}});
  tell(event::EstopChanged{false});
  EXPECT_THAT(state.cause, HasSubstr("e-stop"));
  tell(event::Stopped{});
  press(Button::reset);
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->message, HasSubstr("release it"));
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Release the e-stop"));
  tell(event::EstopChanged{true});
  EXPECT_EQ(state.machine, MachineState::error) << "releasing starts nothing";
  press(Button::reset);
  EXPECT_EQ(state.machine, MachineState::initialized);
}

TEST_F(Station, AnEstopThatIsPressedAtStartUpIsAFault) {
  tell(event::PanelFound{false, true});
  EXPECT_EQ(state.machine, MachineState::error);
}

TEST_F(Station, AnOpenGuardStopsAMovingTableButNotAFlip) {
  reach_flip();
  tell(event::GuardChanged{false});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
  press(Button::start);
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->message, HasSubstr("guard"));
  tell(event::GuardChanged{true});
  press(Button::start);
  tell(event::GuardChanged{false});
  EXPECT_EQ(state.machine, MachineState::error);
}

TEST_F(Station, ATableThatCannotBeSeenStandingIsSaidToMayBeMoving) {
  begin_scan();
  press(Button::stop);
  tell(event::StopFailed{{ErrorCode::timeout, "turntable: no reply"}});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_THAT(state.cause, HasSubstr("may be moving"));
  EXPECT_EQ(state.activity, Activity::none) << "or Reset could never be pressed";
  ASSERT_EQ(state.devices.size(), 1u) << "shown as absent too, although no device is checked now";
  EXPECT_EQ(state.devices[0].name, "turntable");
  EXPECT_EQ(state.devices[0].problem->message, "turntable: no reply");
}

TEST_F(Station, AFullDiskInterruptsTheJobAndStopsTheTableButLatchesNothing) {
  begin_scan();
  take(0, 0);
  tell(event::StoreFailed{"job", {ErrorCode::io, "cannot write: No space left on device"}});
  EXPECT_EQ(state.machine, MachineState::halted);
  EXPECT_FALSE(state.latch);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  EXPECT_THAT(state.cause, HasSubstr("No space left on device; check the disk"));
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted) << "with room again it can be resumed";
  tell(event::Stopped{});
  EXPECT_EQ(state.activity, Activity::none) << "and homes by itself no more than after Stop";
  EXPECT_EQ(describe(state, rules).next_action, "Check the job disk. Press Reset.");
}

TEST_F(Station, AFullDiskWhileNothingMovesKeepsTheTableHomed) {
  const event::StoreFailed full{"job", {ErrorCode::io, "cannot write: No space left on device"}};
  get_ready();
  press(Button::start);
  tell(full);  // the job's folder could not be made
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_THAT(state.cause, HasSubstr("did not start: cannot write: No space left on device."));
  tell(event::WarningOver{});
  EXPECT_EQ(asked_for<action::TakeView>(), nullptr);

  press(Button::start);
  tell(event::JobStarted{"job", 0, 0});
  EXPECT_FALSE(state.disk_trouble) << "its folder could be written";
  tell(event::WarningOver{});
  take_and_store_all(0);
  tell(full);  // the end of the pose could not be written
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_FALSE(state.job);
}

TEST_F(Station, AFaultIsNotForgottenOverAFullDisk) {
  begin_scan();
  tell(event::RigFailed{{ErrorCode::timeout, "turntable: no reply"}});
  tell(event::StoreFailed{"job", {ErrorCode::io, "cannot write: No space left on device"}});
  tell(event::EstopWindowOver{});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_TRUE(state.latch);
  EXPECT_EQ(state.cause, "turntable: no reply.");
}

TEST_F(Station, AFailedReconstructionSparesTheFlip) {
  begin_scan();
  tell(event::ReconstructionFailed{"job", {ErrorCode::out_of_range, "the object is larger than the working volume"}});
  EXPECT_EQ(state.machine, MachineState::single_execution) << "the frames of the pose are evidence";
  take_and_store_all(0);
  tell(event::PoseStored{"job", 0});
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::failed);
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Station, RemoteStopIsAlwaysObeyed) {
  begin_scan();
  press(Button::stop, Origin::remote);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
}

TEST_F(Station, ShutdownInterruptsTheJobAndEndsWhenTheRigIsSeenStopped) {
  begin_scan();
  tell(event::Shutdown{});
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
  EXPECT_FALSE(state.finished);
  press(Button::start);
  EXPECT_TRUE(refused);
  tell(event::Stopped{});
  EXPECT_TRUE(state.finished);
}

TEST_F(Station, LateEventsOfAnOldJobChangeNothing) {
  get_ready();
  const auto before = state.cause;
  tell(event::ViewStored{{"old", 0, 0}, 0.0});
  tell(event::PoseStored{"old", 0});
  tell(event::StoreFailed{"old", {ErrorCode::io, "late"}});
  tell(event::WarningOver{});
  take(0, 0);
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_EQ(state.cause, before);
  EXPECT_TRUE(actions.empty());
}

TEST_F(Station, EveryStateHasASentence) {
  const auto said = [&] { return !describe(state, rules).sentence.empty() && !state.cause.empty(); };
  EXPECT_TRUE(said());
  start_up();
  EXPECT_TRUE(said());
  press(Button::reset);
  EXPECT_TRUE(said());
  tell(event::WarningOver{});
  EXPECT_TRUE(said());
  tell(event::Homed{});
  EXPECT_TRUE(said());
  press(Button::start);
  EXPECT_TRUE(said());
  tell(event::WarningOver{});
  EXPECT_TRUE(said());
  tell(event::EstopChanged{false});
  EXPECT_TRUE(said());
}

}  // namespace
}  // namespace scanrig
