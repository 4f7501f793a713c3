#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

/// The job disk does not respond.
class HangingDisk : public Station {
 protected:
  void hang() {
    tell(event::DiskChecked{Error{ErrorCode::io, "the disk with /jobs has not responded for 30 s; check it"}});
  }
  void expect_interrupted() {
    ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
    EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted);
    EXPECT_THAT(asked_for<action::CloseJob>()->why.message, HasSubstr("/jobs has not responded"));
    EXPECT_FALSE(state.job);
    EXPECT_FALSE(state.latch) << "it is no fault of the rig";
  }
};

TEST_F(HangingDisk, InterruptsTheScanAndStopsTheRig) {
  begin_scan();
  take(0, 0);
  hang();
  expect_interrupted();
  EXPECT_NE(asked_for<action::StopRig>(), nullptr);
  EXPECT_EQ(state.machine, MachineState::halted);
  EXPECT_THAT(state.cause, HasSubstr("for 30 s; check it, then resume the job."));
}

TEST_F(HangingDisk, InterruptsTheJobWhereNothingMovesToo) {
  reach_flip();
  hang();
  expect_interrupted();
  EXPECT_EQ(asked_for<action::StopRig>(), nullptr);
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(HangingDisk, BeginsNothingUntilItAnswers) {
  get_ready();
  know(queued("a", 1));
  hang();
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Check the job disk"));
  EXPECT_THAT(describe(state, rules).sentence, HasSubstr("does not respond"));
  const auto expect_refused = [&] {
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->code, ErrorCode::io);
    EXPECT_THAT(refused->message, HasSubstr("/jobs has not responded for 30 s; check it"));
    EXPECT_TRUE(actions.empty());
  };
  press(Button::start);
  expect_refused();
  tell(event::JobsOrdered{.order = {}, .new_ids = {"b"}});
  expect_refused();
  tell(event::JobRequested{.what = event::JobRequested::What::cancel, .job = "a"});
  expect_refused();
  tell(event::ReloadRequested{});
  expect_refused();

  tell(event::DiskChecked{});
  press(Button::start);
  EXPECT_NE(asked_for<action::StartJob>(), nullptr);
}

TEST_F(HangingDisk, HoldsTheLineAndLetsItGoOn) {
  rules.recipes["line"] = {.name = "line", .poses = 1, .views = 1, .start_on_part = true};
  get_ready();
  know(queued("a", 1, rules.recipes["line"]));
  know(queued("b", 2, rules.recipes["line"]));
  press(Button::start);
  tell(event::JobStarted{"a", 0, 0});
  tell(event::WarningOver{});
  tell(event::ViewTaken{std::make_shared<TakenView>(TakenView{.id = {"a", 0, 0}})});
  tell(event::ViewStored{{"a", 0, 0}, 0.0});
  tell(event::CheckViewTaken{std::make_shared<TakenView>(TakenView{.id = {"a", 0, 0}})});
  tell(event::MovementChecked{"a", {.unmoved = true}});
  tell(event::PoseStored{"a", 0});
  ASSERT_EQ(state.activity, Activity::waiting_for_part);
  hang();
  event::InputsRead part{};
  part.inputs.part_present = false;
  tell(part);
  part.inputs.part_present = true;
  tell(part);
  EXPECT_EQ(asked_for<action::StartJob>(), nullptr);
  tell(event::DiskChecked{});
  ASSERT_NE(asked_for<action::StartJob>(), nullptr);
  EXPECT_EQ(asked_for<action::StartJob>()->job, "b");
}

TEST_F(HangingDisk, AJobThatWasStoppedBeforeItsFolderWasThereIsNotQueued) {
  get_ready();
  press(Button::start);
  press(Button::stop);
  know(queued("job", 0));
  tell(event::JobStarted{"job", 0, 0});
  tell(event::JobClosed{"job", JobState::cancelled, {ErrorCode::stopped, "Stop was pressed"}});
  EXPECT_TRUE(state.queue.empty());
}

}  // namespace
}  // namespace scanrig
