#include <gmock/gmock.h>

#include "daemon/station/operator_message.h"
#include "tests/unit/daemon/queue_under_test.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const Error kOthers{ErrorCode::refused, "calibration.json is of the cameras A and B"};

/// A calibration of other cameras than the rig's refuses the scan.
class CalibrationRules : public Queue {
 protected:
  void see_calibration(const std::string& job, const std::optional<Error>& problem) {
    tell(event::CalibrationChecked{job, problem});
  }
  static JobInfo half_done(const std::string& id) {
    auto job = queued(id, 1);
    job.stored.push_back({0, 0});
    return job;
  }
};

TEST_F(CalibrationRules, OfOtherCamerasRefusesStartUntilItIsReplaced) {
  get_ready();
  see_calibration("", kOthers);
  EXPECT_THAT(describe(state, rules).next_action, StartsWith("Check the calibration: calibration.json is of"));
  press(Button::start);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, ErrorCode::refused);
  EXPECT_THAT(refused->message, HasSubstr("A and B"));
  EXPECT_TRUE(actions.empty());
  see_calibration("", std::nullopt);
  press(Button::start);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::StartJob>(), nullptr);
}

TEST_F(CalibrationRules, IsAskedForWithTheDevicesAndForTheHeadOfTheQueue) {
  tell(event::PanelFound{true, true});
  tell(event::Stopped{});
  ASSERT_NE(asked_for<action::CheckCalibration>(), nullptr);
  EXPECT_EQ(asked_for<action::CheckCalibration>()->job, "");
  know(half_done("a"));
  ASSERT_NE(asked_for<action::CheckCalibration>(), nullptr);
  EXPECT_EQ(asked_for<action::CheckCalibration>()->job, "a") << "its views were taken with its own";
  know(queued("b", 2));
  EXPECT_EQ(asked_for<action::CheckCalibration>(), nullptr) << "a is still the first";
  know(queued("c", 0));
  ASSERT_NE(asked_for<action::CheckCalibration>(), nullptr);
  EXPECT_EQ(asked_for<action::CheckCalibration>()->job, "") << "c has no views: it will have the rig's";
  tell(event::CheckDue{});
  EXPECT_NE(asked_for<action::CheckCalibration>(), nullptr);
}

TEST_F(CalibrationRules, OneOfAnotherJobRefusesNothing) {
  get_ready();
  see_calibration("a", kOthers);
  press(Button::start);
  EXPECT_FALSE(refused);
}

TEST_F(CalibrationRules, AJobWithViewsIsHeldByItsOwnOnly) {
  get_ready();
  know(half_done("a"));
  see_calibration("", kOthers);
  EXPECT_THAT(describe(state, rules).next_action, HasSubstr("Do not move the part of"));
  see_calibration("a", kOthers);
  press(Button::start);
  EXPECT_TRUE(refused);
}

TEST_F(CalibrationRules, HoldsTheLineUntilItIsReplaced) {
  run_a_line_of(2);
  scan("0");
  see_calibration("", kOthers);
  EXPECT_THAT(describe(state, rules).next_action, StartsWith("Check the calibration: "));
  see(false);
  see(true);
  EXPECT_EQ(state.activity, Activity::waiting_for_part);
  EXPECT_TRUE(actions.empty());
  see_calibration("", std::nullopt);
  EXPECT_NE(asked_for<action::StartJob>(), nullptr) << "the part has been there all the time";
}

TEST_F(CalibrationRules, AScanThatHasBegunGoesOnAfterItsFlip) {
  reach_flip();
  see_calibration("", kOthers);
  press(Button::start);
  EXPECT_FALSE(refused);
  EXPECT_NE(asked_for<action::ResumeJob>(), nullptr);
}

}  // namespace
}  // namespace scanrig
