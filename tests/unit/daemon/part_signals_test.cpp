#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/queue_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

const Error kNothingSeen{ErrorCode::degenerate, "nothing seen"};

/// Part after part, with no person there.
class Line : public Queue {
 protected:
  void scan_next(const std::string& job) {
    see(false);
    see(true);
    scan(job);
  }
  void fail_model(const std::string& job) { tell(event::ReconstructionFailed{job, kNothingSeen}); }
  void make_model(const std::string& job) { tell(event::ModelReady{job, "m", "r"}); }
  PanelOutputs outputs() const { return lamps(state, jobs); }
  void list(const std::string& id, JobState job_state) {
    jobs[id] = std::make_shared<const JobInfo>(JobInfo{.id = id, .state = job_state});
  }

  JobTable jobs;
};

TEST_F(Line, PassAndFailSpeakOfThePartPutOnLast) {
  get_ready();
  know(queued("newer", 1, by_parts()));
  know(queued("earlier", 2, by_parts()));
  list("earlier", JobState::failed);
  EXPECT_FALSE(outputs().fail) << "no part was put on";
  press(Button::start);
  scan("newer");
  list("newer", JobState::done);
  EXPECT_TRUE(outputs().pass);
  see(false);
  see(true);
  list("earlier", JobState::scanning);
  EXPECT_FALSE(outputs().pass) << "this one has not ended yet";
  EXPECT_FALSE(outputs().fail);
  scan("earlier");
  list("earlier", JobState::failed);
  EXPECT_FALSE(outputs().pass);
  EXPECT_TRUE(outputs().fail);
  list("newer", JobState::failed);
  list("earlier", JobState::done);
  EXPECT_TRUE(outputs().pass);
  EXPECT_FALSE(outputs().fail);
}

TEST_F(Line, AFailureAfterTheFirstPoseSparesTheFlip) {
  reach_flip();
  tell(event::ReconstructionFailed{"another", kNothingSeen});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
  tell(event::ReconstructionFailed{"job", kNothingSeen});
  ASSERT_NE(asked_for<action::CloseJob>(), nullptr);
  EXPECT_EQ(asked_for<action::CloseJob>()->state, JobState::failed);
  EXPECT_EQ(asked_for<action::CloseJob>()->why.code, ErrorCode::degenerate);
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_FALSE(outputs().flip_request);
}

TEST_F(Line, AFailureOfTheSecondPosesModelLeavesItsViewsToBeTaken) {
  reach_flip();
  press(Button::start);
  tell(event::WarningOver{});
  tell(event::ReconstructionFailed{"job", kNothingSeen});
  EXPECT_EQ(state.activity, Activity::scanning) << "with all views it can be reprocessed";
}

TEST_F(Line, AHandshakeWithTheGuardOpenIsServedWhenItCloses) {
  rules.recipes["default"].flip_by_signal = true;
  for (const bool held : {true, false}) {
    state = {};
    reach_flip();
    tell(event::GuardChanged{false});
    see(true, true);
    EXPECT_EQ(state.activity, Activity::waiting_for_flip) << "nothing moves with an open guard";
    EXPECT_TRUE(actions.empty());
    EXPECT_THAT(state.cause, HasSubstr("The guard is open: close it first.")) << "and it is said why";
    EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Close the guard"));
    if (!held) see(true, false);
    tell(event::GuardChanged{true});
    EXPECT_NE(asked_for<action::ResumeJob>(), nullptr);
    EXPECT_NE(asked_for<action::Warn>(), nullptr);
    EXPECT_EQ(state.job->pose, 1);
  }
}

TEST_F(Line, AHandshakeBeforeTheFlipIsAskedForIsNone) {
  rules.recipes["default"].flip_by_signal = true;
  begin_scan();
  take_and_store_all(0);
  see(true, true);
  tell(event::PoseStored{"job", 0});
  tell(event::GuardChanged{false});
  tell(event::GuardChanged{true});
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
}

TEST_F(Line, ReprocessingNeitherStopsTheLineNorForgivesIt) {
  run_a_line_of(4);
  scan("0");
  make_model("0");
  for (int i = 0; i < 3; ++i) fail_model("0");
  for (const auto* job : {"x", "y", "z"}) fail_model(job);
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  scan_next("1");
  fail_model("1");
  scan_next("2");
  fail_model("2");
  make_model("x");
  EXPECT_EQ(state.failures, 2);
  scan_next("3");
  fail_model("3");
  EXPECT_EQ(state.failures, 3);
}

TEST_F(Line, WhatWasCancelledCountsNeitherThenNorWhenReprocessed) {
  run_a_line_of(2);
  scan("0");
  auto job = queued("0", 0, by_parts());
  job.state = JobState::cancelled;
  know(job);
  job.state = JobState::reconstructing;
  know(job);
  fail_model("0");
  EXPECT_EQ(state.failures, 0);
}

TEST_F(Line, ThreePartsThatNobodyTurnsOverStopIt) {
  get_ready();
  for (int i = 0; i < 4; ++i) {
    auto recipe = by_parts();
    recipe.poses = 2;
    know(queued(fmt::format("{}", i), i, recipe));
  }
  press(Button::start);
  scan("0");
  tell(event::FlipTimedOut{"0"});
  scan_next("1");
  tell(event::FlipTimedOut{"1"});
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  scan_next("2");
  tell(event::FlipTimedOut{"2"});
  EXPECT_EQ(state.machine, MachineState::ready);
  EXPECT_THAT(state.cause, HasSubstr("3 jobs in a row failed"));
}

}  // namespace
}  // namespace scanrig
