#include "drivers/projector/camera_strobe_projector.h"

#include <gmock/gmock.h>

#include <vector>

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;

/// A camera that does what it is told, and notes it.
class ScriptedStrobe final : public CameraStrobe {
 public:
  Result<void> select_output(const std::string& output, Deadline deadline) override {
    calls.push_back(output.empty() ? "off" : output);
    deadlines.push_back(deadline);
    if (output.empty()) return off;
    if (when_selected) when_selected();
    return selected;
  }
  Result<void> start_exposure(Deadline deadline) override {
    calls.emplace_back("expose");
    deadlines.push_back(deadline);
    if (when_exposing) when_exposing();
    return exposed;
  }

  std::vector<std::string> calls;
  std::vector<Deadline> deadlines;
  std::function<void()> when_selected, when_exposing;
  Result<void> selected, exposed, off;
};

class CameraStrobeProjectorTest : public testing::Test {
 protected:
  Deadline within(milliseconds time) { return Deadline::after(clock_, time); }
  Result<void> fire(Light light = Light::pattern) { return projector_.fire(light, within(milliseconds(5000))); }

  static constexpr milliseconds kExposure{30}, kDelay{10};

  RealClock clock_;
  ScriptedStrobe strobe_;
  CameraStrobeProjector projector_{{"Line1", "Line2", kExposure, kDelay}, strobe_, clock_};
};

TEST_F(CameraStrobeProjectorTest, EachLightHasItsOutputWhichIsOffAfterwards) {
  const auto begun = clock_.now();
  ASSERT_TRUE(fire(Light::pattern));
  EXPECT_GE(clock_.now() - begun, kExposure + kDelay) << "the exposure is over";
  EXPECT_THAT(strobe_.calls, ElementsAre("Line1", "expose", "off"));
  strobe_.calls.clear();
  ASSERT_TRUE(fire(Light::plain));
  EXPECT_THAT(strobe_.calls, ElementsAre("Line2", "expose", "off"));
}

TEST_F(CameraStrobeProjectorTest, AStopBeforeTheTriggerCancelsIt) {
  strobe_.when_selected = [&] { projector_.request_off(); };
  const auto fired = fire();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::io);
  EXPECT_THAT(fired.error().message, HasSubstr("projector: went dark on request"));
  EXPECT_THAT(strobe_.calls, ElementsAre("Line1", "off"));
}

TEST_F(CameraStrobeProjectorTest, AStopDuringTheExposureEndsTheLightAtOnce) {
  CameraStrobeProjector projector({"Line1", "Line2", milliseconds(20'000), kDelay}, strobe_, clock_);
  strobe_.when_exposing = [&] { projector.request_off(); };
  const auto begun = clock_.now();
  const auto fired = projector.fire(Light::pattern, within(milliseconds(60'000)));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::io);
  EXPECT_LT(clock_.now() - begun, milliseconds(10'000));
  EXPECT_EQ(strobe_.calls.back(), "off");
}

TEST_F(CameraStrobeProjectorTest, AStopBeforeAFireDoesNotSpoilIt) {
  projector_.request_off();
  EXPECT_TRUE(fire());
}

TEST_F(CameraStrobeProjectorTest, AfterAFailureTheOutputIsSwitchedOffToo) {
  strobe_.exposed = fail(ErrorCode::timeout, "left camera 7: no reply");
  const auto fired = fire();
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::timeout);
  EXPECT_EQ(fired.error().message, "projector: left camera 7: no reply");
  EXPECT_THAT(strobe_.calls, ElementsAre("Line1", "expose", "off"));
  strobe_.calls.clear();
  strobe_.selected = fail(ErrorCode::io, "left camera 7: not connected");
  ASSERT_FALSE(fire());
  EXPECT_THAT(strobe_.calls, ElementsAre("Line1", "off")) << "it may be on although it was not confirmed";
}

TEST_F(CameraStrobeProjectorTest, AnOutputThatCannotBeSwitchedOffIsNamed) {
  strobe_.off = fail(ErrorCode::io, "left camera 7: not connected");
  for (const auto& result : {fire(), projector_.turn_off(within(milliseconds(5000)))}) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().message, "projector: the light may be on: left camera 7: not connected");
  }
}

TEST_F(CameraStrobeProjectorTest, TimeForSwitchingOffIsKept) {
  const auto deadline = within(milliseconds(5000));
  ASSERT_TRUE(projector_.fire(Light::pattern, deadline));
  constexpr milliseconds kOff{700};
  EXPECT_LE(strobe_.deadlines[0].at, deadline.at - kOff);
  EXPECT_LE(strobe_.deadlines[1].at, deadline.at - kOff);
  EXPECT_LE(strobe_.deadlines[2].at, clock_.now() + kOff) << "a stop does not wait for a camera that is gone";
}

TEST_F(CameraStrobeProjectorTest, AnExposureThatNoLongerFitsIsNotBegun) {
  strobe_.when_selected = [&] { clock_.sleep_for(milliseconds(60)); };
  const auto fired = projector_.fire(Light::pattern, within(milliseconds(700 + 90)));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::timeout);
  EXPECT_EQ(fired.error().message, "projector: an exposure of 30000 us does not fit before the deadline");
  EXPECT_THAT(strobe_.calls, ElementsAre("Line1", "off"));
}

}  // namespace
}  // namespace scanrig
