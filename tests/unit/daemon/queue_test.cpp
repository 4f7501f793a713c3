#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/queue_under_test.h"

namespace scanrig {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;
using What = event::JobRequested::What;

TEST_F(Queue, AnOrderMakesOneFolderAJobBehindTheOthers) {
  rules.recipes["small"] = {.name = "small", .views = 5};
  know(queued("a", 4));
  order("small", 3, "4711");
  const auto* create = asked_for<action::CreateJobs>();
  ASSERT_NE(create, nullptr);
  EXPECT_THAT(create->ids, ElementsAre("new0", "new1", "new2"));
  EXPECT_EQ(create->recipe.views, 5);
  EXPECT_EQ(create->part, "4711");
  EXPECT_EQ(create->place, 5);
  EXPECT_EQ(create->request_id, 7u);
}

TEST_F(Queue, AnOrderThatCannotBeUnderstoodIsRefused) {
  order("nothing");
  EXPECT_EQ(refused->code, ErrorCode::not_found);
  EXPECT_THAT(refused->message, HasSubstr("\"nothing\""));
  for (const int repeat : {0, 101}) {
    order("default", repeat);
    EXPECT_EQ(refused->code, ErrorCode::invalid_input);
  }
  order("default", 1, std::string(201, 'x'));
  EXPECT_EQ(refused->code, ErrorCode::invalid_input);
  EXPECT_TRUE(actions.empty());
}

TEST_F(Queue, StandsInTheOrderOfPlaces) {
  know(queued("b", 2));
  know(queued("a", 1));
  know(queued("c", 2));
  EXPECT_THAT(waiting(), ElementsAre("a", "b", "c"));
  know(queued("c", -1));
  EXPECT_THAT(waiting(), ElementsAre("c", "a", "b"));
  auto ended = queued("a", 1);
  ended.state = JobState::cancelled;
  know(ended);
  EXPECT_THAT(waiting(), ElementsAre("c", "b"));
  tell(event::JobRemoved{"c"});
  EXPECT_THAT(waiting(), ElementsAre("b"));
}

TEST_F(Queue, StartTakesTheFirstJobAndItsRecipe) {
  get_ready();
  know(queued("a", 1, {.name = "small", .poses = 1, .views = 3}));
  know(queued("b", 2));
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("job a"));
  press(Button::start);
  EXPECT_EQ(asked_for<action::CreateJobs>(), nullptr);
  ASSERT_NE(asked_for<action::StartJob>(), nullptr);
  EXPECT_EQ(asked_for<action::StartJob>()->job, "a");
  EXPECT_EQ(state.job->recipe.views, 3);
  EXPECT_EQ(state.machine, MachineState::single_execution);
  EXPECT_THAT(waiting(), ElementsAre("b"));
}

TEST_F(Queue, AJobThatDoesNotFitIsNotBegunAndWaits) {
  get_ready();
  know(queued("a", 1));
  press(Button::start);
  tell(event::JobNotStarted{"a", {ErrorCode::io, "the disk is full"}});
  know(queued("a", 1));
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_EQ(state.activity, Activity::none) << "nothing is about to move";
  EXPECT_THAT(state.cause, HasSubstr("the disk is full"));
  EXPECT_THAT(describe(state, rules).next_action, StartsWith("Check the job disk. "));
  EXPECT_THAT(waiting(), ElementsAre("a"));
  ASSERT_TRUE(state.not_started);
  EXPECT_EQ(state.not_started->job, "a");
  EXPECT_EQ(state.not_started->why.code, ErrorCode::io);
  tell(event::WarningOver{});
  EXPECT_TRUE(actions.empty());
  press(Button::start);
  EXPECT_FALSE(state.not_started) << "it is tried again";
}

TEST_F(Queue, AJobThatDoesNotFitClearsNoFault) {
  get_ready();
  know(queued("a", 1));
  press(Button::start);
  tell(event::RigFailed{{ErrorCode::timeout, "turntable: no reply"}});
  tell(event::JobNotStarted{"a", {ErrorCode::io, "the disk is full"}});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_EQ(state.activity, Activity::stopping);
}

TEST_F(Queue, AJobWhoseFolderIsDamagedIsSetAsideAndTheNextBeginsWithItsPart) {
  run_a_line_of(2);
  tell(event::WarningOver{});
  tell(event::JobUnreadable{"0", {ErrorCode::invalid_input, "scan.json: not JSON"}});
  ASSERT_NE(asked_for<action::StartJob>(), nullptr);
  EXPECT_EQ(asked_for<action::StartJob>()->job, "1");
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  EXPECT_THAT(state.cause, HasSubstr("scan.json: not JSON"));
  EXPECT_THAT(waiting(), IsEmpty());
  scan("1");
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Queue, ADamagedJobsPartIsNotScannedAsAnotherOne) {
  auto other = queued("1", 1, by_parts());
  other.part = "4712";
  run_a_line_of(1);
  know(other);
  tell(event::JobUnreadable{"0", {ErrorCode::invalid_input, "scan.json: not JSON"}});
  EXPECT_TRUE(actions.empty());
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  see(true);
  EXPECT_TRUE(actions.empty()) << "that is the damaged job's part";
  see(false);
  see(true);
  ASSERT_NE(asked_for<action::StartJob>(), nullptr);
  EXPECT_EQ(asked_for<action::StartJob>()->job, "1");
}

TEST_F(Queue, ThreeDamagedJobsInARowStopTheLineAndAFaultKeepsTheWord) {
  const Error damaged{ErrorCode::invalid_input, "scan.json: not JSON"};
  run_a_line_of(5);
  for (const auto* const job : {"0", "1", "2"}) tell(event::JobUnreadable{job, damaged});
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_THAT(waiting(), ElementsAre("3", "4"));
  press(Button::start);
  tell(event::EstopChanged{false});
  tell(event::JobUnreadable{"3", damaged});
  EXPECT_EQ(state.machine, MachineState::error);
  EXPECT_FALSE(asked_for<action::StartJob>());
}

TEST_F(Queue, JobsAreMovedResumedAndKept) {
  know(queued("a", 3));
  know(queued("b", 4));
  ask(What::to_front, "b");
  ASSERT_NE(asked_for<action::MoveJob>(), nullptr);
  EXPECT_EQ(asked_for<action::MoveJob>()->place, 2);
  using How = action::MoveJob::How;
  EXPECT_EQ(asked_for<action::MoveJob>()->how, How::queued);
  ask(What::resume, "old");
  ASSERT_NE(asked_for<action::MoveJob>(), nullptr);
  EXPECT_EQ(asked_for<action::MoveJob>()->how, How::resumed);
  ask(What::add_pose, "old");
  EXPECT_EQ(asked_for<action::MoveJob>()->how, How::one_more);
  EXPECT_EQ(asked_for<action::MoveJob>()->place, 2) << "the next Start scans it";
  for (const auto what :
       {What::cancel, What::remove, What::reprocess, What::set_exported, What::bundle, What::choose}) {
    ask(what, "old");
    EXPECT_NE(asked_for<action::RunJobRequest>(), nullptr);
  }
  ask(What::cancel, "a");
  EXPECT_NE(asked_for<action::RunJobRequest>(), nullptr);
}

TEST_F(Queue, WhatTheStateForbidsIsRefused) {
  ask(What::to_front, "old");
  EXPECT_EQ(refused->code, ErrorCode::refused);
  know(queued("a", 1));
  ask(What::remove, "a");
  EXPECT_EQ(refused->code, ErrorCode::refused);
  begin_scan();
  ask(What::cancel, "a");
  EXPECT_EQ(refused->code, ErrorCode::busy) << "it has the rig: Stop is for that";
  tell(event::Shutdown{});
  ask(What::cancel, "b");
  EXPECT_EQ(refused->code, ErrorCode::refused);
  order("default");
  EXPECT_EQ(refused->code, ErrorCode::refused);
}

TEST_F(Queue, ANewPartBeginsTheNextJobAfterTheWarning) {
  run_a_line_of(2);
  EXPECT_EQ(state.machine, MachineState::continuous_execution);
  scan("0");
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  see(true);
  EXPECT_EQ(state.activity, Activity::waiting_for_part) << "that is still the old part";
  see(false);
  EXPECT_TRUE(actions.empty());
  see(true);
  ASSERT_NE(asked_for<action::StartJob>(), nullptr);
  EXPECT_EQ(asked_for<action::StartJob>()->job, "1");
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  scan("1");
  EXPECT_EQ(state.machine, MachineState::ready) << "the queue is empty";
}

TEST_F(Queue, NothingBeginsByItselfBeforeAPersonsStart) {
  get_ready();
  know(queued("a", 1, by_parts()));
  see(false);
  see(true);
  EXPECT_TRUE(actions.empty());
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Queue, AJobThatIsNotForTheLineWaitsForItsStart) {
  run_a_line_of(1);
  know(queued("by hand", 5));
  scan("0");
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Queue, StopEndsTheLineAndStartIsAPartToo) {
  run_a_line_of(3);
  scan("0");
  press(Button::start);
  EXPECT_NE(asked_for<action::StartJob>(), nullptr) << "the operator vouches for the part";
  scan("1");
  press(Button::stop);
  tell(event::Stopped{});
  EXPECT_EQ(state.machine, MachineState::ready);
  see(false);
  see(true);
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Queue, AnOpenGuardAnAbsentDeviceAndQuietHoursHoldTheLine) {
  run_a_line_of(2);
  scan("0");
  tell(event::QuietHours{true});
  tell(event::GuardChanged{false});
  tell(event::DevicesChecked{{{"camera", Error{ErrorCode::io, "unplugged"}}}});
  see(false);
  see(true);
  tell(event::QuietHours{false});
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  tell(event::GuardChanged{true});
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  tell(event::DevicesChecked{{{"camera", std::nullopt}}});
  EXPECT_NE(asked_for<action::StartJob>(), nullptr) << "the part has been there all the time";
}

TEST_F(Queue, AProjectorThatWarmsUpHoldsTheLineAndSaysForHowLong) {
  run_a_line_of(2);
  scan("0");
  tell(event::WarmingUp{std::chrono::seconds(600)});
  see(false);
  see(true);
  EXPECT_TRUE(actions.empty());
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("warming up: 600 s. Press Start to skip"));
  tell(event::QuietHours{true});
  tell(event::WarmingUp{std::chrono::seconds(0)});
  EXPECT_EQ(state.activity, Activity::waiting_for_part) << "warm, but not now";
  tell(event::WarmingUp{std::chrono::seconds(1)});
  tell(event::QuietHours{false});
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  tell(event::WarmingUp{std::chrono::seconds(0)});
  EXPECT_NE(asked_for<action::StartJob>(), nullptr) << "the part has been there all the time";
}

TEST_F(Queue, AStartBeginsWithAColdProjectorAndWasToldSo) {
  get_ready();
  tell(event::WarmingUp{std::chrono::seconds(42)});
  EXPECT_THAT(describe(state, rules).sentence, HasSubstr("The projector will be warm in 42 s."));
  press(Button::start);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::StartJob>(), nullptr);
}

TEST_F(Queue, ThreeFailuresInARowStopTheLineAndStartForgivesThem) {
  run_a_line_of(8);
  const auto failed = [&](const std::string& job) {
    tell(event::ReconstructionFailed{job, {ErrorCode::degenerate, "nothing seen"}});
    EXPECT_EQ(state.activity, Activity::waiting_for_part) << job;
  };
  for (const auto* job : {"0", "1", "2", "3", "4", "5"}) {
    see(false);
    see(true);
    scan(job);
  }
  failed("0");
  failed("1");
  tell(event::ModelReady{"2", "m", "r"});  // a good one in between
  failed("3");
  failed("4");
  tell(event::ModelReady{"5", "m", "r", Error{ErrorCode::below_limits, "beyond"}});
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_THAT(state.cause, HasSubstr("3 jobs in a row failed"));
  press(Button::start);
  scan("6");
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
}

TEST_F(Queue, AFlipNobodyMakesParksTheJobAndFreesTheRig) {
  reach_flip();
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Turn the part over"));
  tell(event::FlipTimedOut{"another"});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
  tell(event::FlipTimedOut{"job"});
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::interrupted) << "it can be resumed";
  EXPECT_THAT(asked_for<action::CloseJob>()->why.message, HasSubstr("30 min"));
  EXPECT_EQ(state.machine, MachineState::ready);
}

TEST_F(Queue, TheFlipTimeComesFromTheRecipe) {
  rules.recipes["default"].flip_timeout = std::chrono::minutes(5);
  reach_flip();
  ASSERT_NE(asked_for<action::WaitForFlip>(), nullptr);
  EXPECT_EQ(asked_for<action::WaitForFlip>()->limit, std::chrono::minutes(5));
}

TEST_F(Queue, ALineTurnsTheObjectOverByItsSignal) {
  rules.recipes["default"].flip_by_signal = true;
  reach_flip();
  see(true, false);
  EXPECT_TRUE(actions.empty());
  see(true, true);
  EXPECT_NE(asked_for<action::ResumeJob>(), nullptr);
  EXPECT_NE(asked_for<action::Warn>(), nullptr);
  EXPECT_EQ(state.job->pose, 1);
}

TEST_F(Queue, TheSignalMeansNothingWhereAPersonTurnsTheObjectOver) {
  reach_flip();
  see(true, true);
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
}

}  // namespace
}  // namespace scanrig
