// A calibration of the rig, as the transition function leads it: placement by placement.
#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Calibrating : public Station {
 protected:
  Calibrating() { rules.calibration = calibration_recipe(); }
  void order() {
    tell(event::JobsOrdered{.order = {.kind = RecipeKind::calibration}, .new_ids = {"job"}, .request_id = 1});
  }
  /// A ready rig with a calibration at the head of its queue.
  void queue_calibration() {
    get_ready();
    know(queued("job", 0, calibration_recipe()));
  }
  std::string next_action() const { return describe(state, rules).next_action; }
  std::string sentence() const { return describe(state, rules).sentence; }
  void press_start() {
    press(Button::start);
    ASSERT_FALSE(refused) << refused->message;
    tell(event::WarningOver{});
  }
  void begin(int pose = 0, int stored = 0) {
    press(Button::start);
    ASSERT_FALSE(refused) << refused->message;
    tell(event::JobStarted{"job", pose, stored});
    tell(event::WarningOver{});
  }
  void take_all(int pose, bool unmoved = true) {
    for (int view = 0; view < calibration_recipe().views_of(pose); ++view) {
      take(pose, view);
      store(pose, view);
    }
    close_pose(pose, unmoved);
  }
  /// Takes a placement, up to the wait for the next one.
  void complete(int pose) {
    take_all(pose);
    tell(event::PlacementChecked{"job", pose});
    tell(event::PoseStored{"job", pose});
    tell(event::Turned{});
  }
};

TEST_F(Calibrating, IsQueuedBeforeAllOtherJobsAndOnlyOnce) {
  get_ready();
  know(queued("scan", 5));
  order();
  const auto* created = asked_for<action::CreateJobs>();
  ASSERT_TRUE(created);
  EXPECT_EQ(created->recipe, calibration_recipe());
  EXPECT_LT(created->place, 5);
  know(queued("job", created->place, calibration_recipe()));
  order();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::busy);
}

TEST_F(Calibrating, IsRefusedWithoutASolver) {
  rules.calibration.reset();
  order();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::unsupported);
}

TEST_F(Calibrating, SaysWhereTheBoardGoesBeforeAnythingMoves) {
  queue_calibration();
  EXPECT_EQ(awaited_placement(state), 0);
  EXPECT_EQ(
      next_action(),
      "Put the board at mark 0: landscape, 60 deg from flat, centre 35 mm in front of the axis. Then press Start.");
  tell(event::GuardChanged{false});
  EXPECT_THAT(next_action(), HasSubstr("Then close the guard and press Start."));
  press(Button::start);
  EXPECT_TRUE(refused);
}

TEST_F(Calibrating, StartsWithoutACalibrationOfTheRigsCameras) {
  queue_calibration();
  tell(event::CalibrationChecked{"", Error{ErrorCode::refused, "it is for other cameras"}});
  EXPECT_THAT(next_action(), StartsWith("Put the board"));
  press(Button::start);
  EXPECT_FALSE(refused);
}

TEST_F(Calibrating, TakesPlainImagesOverTheAnglesOfItsPlacement) {
  queue_calibration();
  begin();
  const auto* first = asked_for<action::TakeView>();
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->plain_only);
  EXPECT_NEAR(first->angle.value, -56.0, 1e-9);
  take(0, 0);
  ASSERT_TRUE(asked_for<action::TakeView>());
  EXPECT_NEAR(asked_for<action::TakeView>()->angle.value, -56.0 + 112.0 / 6, 1e-9);
}

TEST_F(Calibrating, BringsTheNextMarkToTheFrontThenWaits) {
  queue_calibration();
  begin();
  take_all(0);
  ASSERT_TRUE(asked_for<action::CheckPlacement>());
  tell(event::PlacementChecked{"job", 0});
  ASSERT_TRUE(asked_for<action::FinishPose>());
  tell(event::PoseStored{"job", 0});
  ASSERT_TRUE(asked_for<action::TurnTo>());
  EXPECT_NEAR(asked_for<action::TurnTo>()->angle.value, -120.0, 1e-9);
  EXPECT_EQ(state.activity, Activity::scanning);
  tell(event::Turned{});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
  ASSERT_TRUE(asked_for<action::WaitForFlip>());
  EXPECT_EQ(sentence(), "Placement 1 of 7 is complete.");
  EXPECT_EQ(next_action(),
            "Put the board at mark 120: landscape, 60 deg from flat, centre 30 mm behind the axis, on the block. Then "
            "press Start.");
  const auto shown = lamps(state, {});
  EXPECT_FALSE(shown.flip_request) << "no automation turns a board over";
  EXPECT_TRUE(shown.start_lamp && shown.amber);
}

TEST_F(Calibrating, EveryNextActionIsShort) {
  for (const auto& placement : calibration_plan()) {
    EXPECT_LE(how_to_place(placement).size(), 120u);
  }
}

TEST_F(Calibrating, ReachesItsEndAfterSevenPlacements) {
  queue_calibration();
  begin();
  for (int pose = 0; pose < 6; ++pose) {
    complete(pose);
    press_start();
  }
  take_all(6);
  tell(event::PlacementChecked{"job", 6});
  ASSERT_TRUE(asked_for<action::FinishPose>());
  EXPECT_TRUE(asked_for<action::FinishPose>()->last);
  tell(event::PoseStored{"job", 6});
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_FALSE(state.job);
}

TEST_F(Calibrating, NamesABadImageAtOnce) {
  queue_calibration();
  begin();
  take(0, 0);
  tell(event::ImagesChecked{{"job", 0, 0}, {"left: Image blurred."}});
  EXPECT_THAT(sentence(), HasSubstr("View 1, left: Image blurred."));
}

TEST_F(Calibrating, TooFewGoodViewsRepeatThePlacement) {
  queue_calibration();
  begin();
  complete(0);
  press_start();
  take_all(1);
  tell(event::PlacementChecked{"job", 1, Error{ErrorCode::below_limits, "3 good views, 5 are needed"}});
  ASSERT_TRUE(asked_for<action::DropPlacement>());
  tell(event::PlacementDropped{"job", 1, {ErrorCode::below_limits, "3 good views, 5 are needed"}});
  tell(event::Turned{});
  EXPECT_EQ(sentence(), "Placement 2 of 7 again: 3 good views, 5 are needed.");
  EXPECT_THAT(next_action(), StartsWith("Put the board at mark 120"));
  press_start();
  ASSERT_TRUE(asked_for<action::TakeView>());
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 1, 0}));
}

TEST_F(Calibrating, ASlippedBoardRepeatsOnlyItsPlacement) {
  queue_calibration();
  begin();
  take_all(0, false);
  const auto* dropped = asked_for<action::DropPlacement>();
  ASSERT_TRUE(dropped);
  EXPECT_EQ(dropped->why.message, "the board slipped in placement 1");
  EXPECT_FALSE(asked_for<action::CloseJob>());
}

TEST_F(Calibrating, ContinuesAPlacementOnlyAfterTheMovementCheck) {
  get_ready();
  auto job = queued("job", 0, calibration_recipe());
  job.complete = 1;
  job.stored = {{.pose = 1, .view = 0}, {.pose = 1, .view = 1}};
  know(job);
  EXPECT_FALSE(awaited_placement(state));
  EXPECT_EQ(next_action(), "Do not move the board, then press Start.");
  begin(1, 2);
  const auto* check = asked_for<action::TakeView>();
  ASSERT_TRUE(check);
  EXPECT_TRUE(check->movement_check);
  EXPECT_NEAR(check->angle.value, -176.0, 1e-9);
  close_pose(1);
  ASSERT_TRUE(asked_for<action::TakeView>());
  EXPECT_EQ(asked_for<action::TakeView>()->id.view, 2);
}

TEST_F(Calibrating, StopEstopAndGuardInterruptItWhileTheTableTurnsToTheMark) {
  const std::vector<std::pair<Event, MachineState>> ends{
      {event::Pressed{Button::stop, Origin::remote, {}}, MachineState::halted},
      {event::EstopChanged{false}, MachineState::error},
      {event::GuardChanged{false}, MachineState::error}};
  for (const auto& [event, machine] : ends) {
    state = {};
    queue_calibration();
    begin();
    take_all(0);
    tell(event::PlacementChecked{"job", 0});
    tell(event::PoseStored{"job", 0});
    tell(event);
    EXPECT_EQ(state.machine, machine);
    ASSERT_TRUE(asked_for<action::CloseJob>());
    EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
    EXPECT_TRUE(asked_for<action::StopRig>());
    tell(event::Turned{});
    EXPECT_EQ(state.machine, machine) << "too late";
  }
}

TEST_F(Calibrating, ABoardThatIsNotPutInPlaceParksIt) {
  queue_calibration();
  begin();
  complete(0);
  tell(event::FlipTimedOut{"job"});
  ASSERT_TRUE(asked_for<action::CloseJob>());
  EXPECT_THAT(asked_for<action::CloseJob>()->why.message, HasSubstr("board not put in place in 30 min"));
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Calibrating, NoMaintenanceWhileItWaitsForTheBoard) {
  queue_calibration();
  begin();
  complete(0);
  tell(event::MaintenanceRequested{.what = event::MaintenanceRequested::What::on});
  EXPECT_TRUE(refused);
}

TEST_F(Calibrating, IsAcceptedByAPersonUnlessConfiguredOtherwise) {
  const event::ModelReady solved{"job", "m", "r", std::nullopt, CalibrationOutcome{.grade = "A"}};
  tell(solved);
  EXPECT_FALSE(asked_for<action::RunJobRequest>());
  rules.accepts_calibrations = true;
  tell(solved);
  ASSERT_TRUE(asked_for<action::RunJobRequest>());
  EXPECT_EQ(asked_for<action::RunJobRequest>()->asked.what, event::JobRequested::What::accept);
}

TEST_F(Calibrating, AnOldCalibrationIsSaidWhileTheRigIsReady) {
  get_ready();
  tell(event::CalibrationChecked{"", std::nullopt, "The calibration is older than 24 h."});
  EXPECT_THAT(sentence(), HasSubstr("The calibration is older than 24 h."));
}

}  // namespace
}  // namespace scanrig
