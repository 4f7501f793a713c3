#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// Movement checks, and jobs that continue after an interruption.
class Resume : public Station {
 protected:
  /// The job "job" becomes active again, with `stored` views of `pose`.
  void resume(int pose, int stored) {
    get_ready();
    auto job = queued("job", -1, rules.recipes.at("default"));
    job.complete = pose;
    for (int view = 0; view < stored; ++view) job.stored.push_back({pose, view});
    know(job);
    said = describe(state, rules).next_action;
    press(Button::start);
    tell(event::WarningOver{});
    tell(event::JobStarted{"job", pose, stored});
  }
  std::string said;
};

TEST_F(Resume, TakesView0AgainBeforeAnythingElse) {
  resume(0, 2);
  EXPECT_THAT(said, HasSubstr("Do not move the part"));
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_TRUE(asked_for<action::TakeView>()->movement_check);
  tell(event::CheckViewTaken{});
  EXPECT_NE(asked_for<action::CheckMovement>(), nullptr);
  EXPECT_EQ(asked_for<action::TakeView>(), nullptr) << "not before it is judged";
  tell(event::MovementChecked{"job", {.unmoved = true}});
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 0, 2}));
  EXPECT_EQ(asked_for<action::TakeView>()->angle.value, 180.0);
}

TEST_F(Resume, AnObjectThatMovedSinceEndsTheAttemptAndTheRigIsFree) {
  resume(0, 2);
  close_pose(0, false);
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
  EXPECT_EQ(asked_for<action::CloseJob>()->why.code, ErrorCode::moved);
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_EQ(state.failures, 0) << "no part was bad";
}

TEST_F(Resume, WithAllViewsThereTheCheckIsTheMovementCheck) {
  resume(0, 4);
  close_pose(0);
  ASSERT_NE(asked_for<action::FinishPose>(), nullptr);
  EXPECT_FALSE(asked_for<action::FinishPose>()->last);
  tell(event::PoseStored{"job", 0});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
}

TEST_F(Resume, BetweenThePosesTheObjectIsTurnedOverAndNothingIsCompared) {
  resume(1, 0);
  EXPECT_THAT(said, HasSubstr("turned over"));
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_FALSE(asked_for<action::TakeView>()->movement_check);
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 1, 0}));
}

TEST_F(Resume, InTheSecondPoseItsOwnView0IsCompared) {
  resume(1, 3);
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 1, 0}));
  close_pose(1);
  ASSERT_NE(asked_for<action::TakeView>(), nullptr);
  EXPECT_EQ(asked_for<action::TakeView>()->id, (ViewId{"job", 1, 3}));
}

TEST_F(Resume, AnObjectThatSlippedDuringThePoseFailsTheJob) {
  begin_scan();
  for (int view = 0; view < views(); ++view) {
    take(0, view);
    store(0, view);
  }
  close_pose(0, false);
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::failed);
  EXPECT_THAT(asked_for<action::CloseJob>()->why.message, HasSubstr("something moved in pose 1"));
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_EQ(state.failures, 1);
}

TEST_F(Resume, AVerdictThatComesAfterAFaultClearsNothing) {
  for (const bool unmoved : {true, false}) {
    state = {};
    resume(0, 2);
    tell(event::CheckViewTaken{});
    tell(event::RigFailed{{ErrorCode::timeout, "turntable: no reply"}});
    tell(event::MovementChecked{"job", {.unmoved = unmoved}});
    EXPECT_EQ(state.machine, MachineState::error);
    EXPECT_EQ(state.activity, Activity::stopping);
    EXPECT_TRUE(actions.empty());
  }
}

TEST_F(Resume, AMovementCheckThatComesAfterStopChangesNothing) {
  resume(0, 2);
  press(Button::stop);
  close_pose(0, false);
  EXPECT_TRUE(actions.empty());
  EXPECT_EQ(state.machine, MachineState::halted);
}

}  // namespace
}  // namespace scanrig
