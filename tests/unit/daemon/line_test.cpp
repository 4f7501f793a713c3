#include <gtest/gtest.h>

#include "daemon/station/lamps.h"
#include "tests/unit/daemon/queue_under_test.h"

namespace scanrig {
namespace {

const Error kNothingSeen{ErrorCode::degenerate, "nothing seen"};

/// Part after part, with nobody there.
class Line : public Queue {
 protected:
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
  EXPECT_FALSE(outputs().pass) << "nobody knows yet how this one ends";
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

}  // namespace
}  // namespace scanrig
