#include <gtest/gtest.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/station_under_test.h"

namespace scanrig {
namespace {

class HeadlineTest : public Station {
 protected:
  HeadlineTest() { rules.remote = rules.guard = true; }
  [[nodiscard]] std::string shown() const {
    const auto [tone, word] = headline(state);
    return std::string(to_string(tone)) + " " + word;
  }
  [[nodiscard]] std::string offer() const { return remote_actions(state, rules).start_offer; }
  void start(const std::string& seen) { tell(event::Pressed{Button::start, Origin::remote, "job", seen}); }
};

TEST_F(HeadlineTest, AScanReadsFromAfar) {
  EXPECT_EQ(shown(), "idle WAIT");
  start_up();
  EXPECT_EQ(shown(), "act RESET");
  press(Button::reset);
  EXPECT_EQ(shown(), "act KEEP CLEAR");
  tell(event::WarningOver{});
  EXPECT_EQ(shown(), "working HOMING");
  tell(event::Homed{});
  EXPECT_EQ(shown(), "ready READY");
  press(Button::start);
  tell(event::JobStarted{"job", 0, 0});
  tell(event::WarningOver{});
  EXPECT_EQ(shown(), "working 1/4");
  take(0, 0);
  EXPECT_EQ(shown(), "working 2/4");
  for (int view = 0; view < 4; ++view) {
    if (view > 0) take(0, view);
    store(0, view);
  }
  EXPECT_EQ(shown(), "working CHECK");
  close_pose(0);
  EXPECT_EQ(shown(), "working STORING");
  tell(event::PoseStored{"job", 0});
  EXPECT_EQ(shown(), "act FLIP");
}

TEST_F(HeadlineTest, WhatIsWrongComesFirst) {
  begin_scan();
  press(Button::stop);
  EXPECT_EQ(shown(), "act STOPPING");
  tell(event::Stopped{});
  EXPECT_EQ(shown(), "act RESET");
  tell(event::EstopChanged{false});
  tell(event::Stopped{});
  EXPECT_EQ(shown(), "fault FAULT");
  state.may_be_moving = true;
  EXPECT_EQ(shown(), "fault KEEP CLEAR");
}

TEST_F(HeadlineTest, ActionsAreWhatWouldBeObeyed) {
  start_up();
  EXPECT_TRUE(remote_actions(state, rules).start_refused) << "not homed";
  EXPECT_FALSE(remote_actions(state, rules).reset_refused);
  get_ready();
  EXPECT_FALSE(remote_actions(state, rules).start_refused);
  rules.remote = false;
  ASSERT_TRUE(remote_actions(state, rules).start_refused);
  EXPECT_NE(remote_actions(state, rules).start_refused->message.find("use the panel"), std::string::npos);
}

TEST_F(HeadlineTest, AStartThatMeansSomethingElseByNowIsRefused) {
  get_ready();
  const auto begin = offer();
  EXPECT_EQ(begin, "begin-new-");
  start(begin);
  EXPECT_FALSE(refused);
  start(begin);
  EXPECT_TRUE(refused) << "it counts once";
  tell(event::JobStarted{"job", 0, 0});
  tell(event::WarningOver{});
  take_and_store_all(0);
  tell(event::PoseStored{"job", 0});
  const auto go_on = offer();
  EXPECT_EQ(go_on, "continue-job-0");
  start(begin);
  ASSERT_TRUE(refused);
  EXPECT_NE(refused->message.find("The rig has changed since"), std::string::npos);
  EXPECT_EQ(state.activity, Activity::waiting_for_flip);
  start(go_on);
  EXPECT_FALSE(refused);
  EXPECT_EQ(state.activity, Activity::warning);
}

TEST_F(HeadlineTest, AfterAJobTheOfferIsANewOne) {
  get_ready();
  const auto first = offer();
  state.last_started_job = "job";
  EXPECT_NE(offer(), first);
  know(queued("next", 1));
  EXPECT_EQ(offer(), "begin-next-0");
}

}  // namespace
}  // namespace scanrig
