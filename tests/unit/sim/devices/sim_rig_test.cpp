#include "sim/devices/sim_rig.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "tests/own_folder.h"
#include "tests/unit/sim/devices/manual_clock.h"

namespace scanrig::sim {
namespace {

using namespace std::chrono_literals;
using testing::AssertionResult;

/// One rig for all tests: making the figurine takes longer than all of them.
class Rig : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    clock_ = new ManualClock;
    SimRigOptions options;
    options.image_scale = 0.1;
    rig_ = SimRig::create(options, *clock_).value().release();
  }
  static void TearDownTestSuite() {
    delete rig_;
    delete clock_;
  }
  void TearDown() override {  // leave nothing behind for the next test
    rig_->stall_turntable(false);
    rig_->set_estop(true);
    rig_->lose_frames(0);
    (void)rig_->turntable().home(soon());
    ASSERT_TRUE(rig_->turntable().home(soon()));
  }

  static Deadline soon() { return clock_->within(60s); }
  template <class T>
  static AssertionResult fails_with(const Result<T>& result, ErrorCode code) {
    if (result) return testing::AssertionFailure() << "it succeeded";
    if (result.error().code == code) return testing::AssertionSuccess();
    return testing::AssertionFailure() << to_string(result.error().code) << ": " << result.error().message;
  }
  static Result<StereoFrame> expose(Light light) {
    auto& camera = rig_->camera();
    if (const auto armed = camera.arm(soon()); !armed) return pass_on(armed);
    if (const auto fired = rig_->projector().fire(light, soon()); !fired) return pass_on(fired);
    return camera.collect(clock_->within(1s));
  }

  static inline ManualClock* clock_ = nullptr;
  static inline SimRig* rig_ = nullptr;
};

using SimTurntable = Rig;

TEST_F(SimTurntable, TurnsAtItsSpeedAndSettles) {
  ASSERT_TRUE(rig_->turntable().home(soon()));
  const auto move = rig_->turntable().rotate_to({90.0}, soon());
  ASSERT_TRUE(move) << move.error().message;
  EXPECT_NEAR(move->measured.value, 90.0, 0.02);
  // 45 deg/s, 90 deg/s2: half a second up, half a second down, 67.5 degrees between.
  EXPECT_NEAR(std::chrono::duration<double>(move->moving).count(), 2.5, 0.01);
  EXPECT_EQ(std::chrono::round<std::chrono::milliseconds>(move->settling), 200ms);
}

TEST_F(SimTurntable, ReadsAnEncoderWithSteps) {
  const auto move = rig_->turntable().rotate_to({33.3}, soon());
  ASSERT_TRUE(move);
  EXPECT_NEAR(std::remainder(move->measured.value, 0.004), 0.0, 1e-9);
}

TEST_F(SimTurntable, NeedsHomingAfterAFailure) {
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({90.0}, clock_->within(1s)), ErrorCode::timeout));
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({0.0}, soon()), ErrorCode::not_homed));
  EXPECT_FALSE(rig_->turntable().status(soon())->homed);
  EXPECT_TRUE(rig_->turntable().home(soon()));
  EXPECT_TRUE(rig_->turntable().rotate_to({10.0}, soon()));
}

TEST_F(SimTurntable, StopsOnRequestOfAnotherThread) {
  clock_->at(1s, [] { rig_->turntable().request_stop(); });
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({180.0}, soon()), ErrorCode::stopped));
  ASSERT_TRUE(rig_->turntable().stop(soon()));
  const auto status = rig_->turntable().status(soon());
  EXPECT_EQ(status->motion, TurntableStatus::Motion::stopped);
  // One second: 11.25 degrees up to speed, 22.5 at speed, 11.25 braking.
  EXPECT_NEAR(status->angle->value, 45.0, 0.1);
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({0.0}, soon()), ErrorCode::not_homed));
  EXPECT_TRUE(rig_->turntable().home(soon()));
}

TEST_F(SimTurntable, NoticesThatItIsBlocked) {
  clock_->at(1s, [] { rig_->stall_turntable(true); });
  const auto begin = clock_->now();
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({180.0}, soon()), ErrorCode::stalled));
  EXPECT_EQ(clock_->now() - begin, 3s);  // two seconds without progress
  EXPECT_TRUE(fails_with(rig_->turntable().home(soon()), ErrorCode::stalled));
}

TEST_F(SimTurntable, HasNoPowerWhileTheEmergencyStopIsPressed) {
  clock_->at(1s, [] { rig_->set_estop(false); });
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({180.0}, soon()), ErrorCode::device_alarm));
  EXPECT_TRUE(fails_with(rig_->turntable().reset_alarm(soon()), ErrorCode::device_alarm));
  EXPECT_FALSE(rig_->turntable().status(soon())->alarm.empty());
  rig_->set_estop(true);
  EXPECT_TRUE(rig_->turntable().reset_alarm(soon()));
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({0.0}, soon()), ErrorCode::not_homed));
  EXPECT_TRUE(rig_->turntable().home(soon()));
}

TEST_F(SimTurntable, RefusesAnAngleOutOfRangeAndStaysHomed) {
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({1e6}, soon()), ErrorCode::out_of_range));
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({std::nan("")}, soon()), ErrorCode::out_of_range));
  EXPECT_TRUE(rig_->turntable().rotate_to({1.0}, soon()));
}

TEST_F(SimTurntable, ReportsThatItMayBeMovingWhenStoppingTakesTooLong) {
  EXPECT_TRUE(fails_with(rig_->turntable().rotate_to({90.0}, clock_->within(1s)), ErrorCode::timeout));
  EXPECT_EQ(rig_->turntable().status(soon())->motion, TurntableStatus::Motion::moving);
  EXPECT_TRUE(fails_with(rig_->turntable().stop(clock_->within(10ms)), ErrorCode::timeout));
  EXPECT_TRUE(rig_->turntable().stop(soon()));
}

using SimCamera = Rig;

TEST_F(SimCamera, DeliversThePairOfTheEdgeAfterArming) {
  const auto begin = clock_->now();
  const auto pattern = expose(Light::pattern);
  ASSERT_TRUE(pattern) << pattern.error().message;
  EXPECT_EQ(pattern->format, PixelFormat::bayer_rggb8);
  EXPECT_EQ(pattern->left.size(), cv::Size(128, 96));
  EXPECT_EQ(pattern->right.type(), CV_8UC1);
  EXPECT_EQ(pattern->trigger, 1U);
  EXPECT_EQ(pattern->taken, begin);
  EXPECT_GT(clock_->now() - begin, 12ms);
  const auto plain = expose(Light::plain);
  ASSERT_TRUE(plain);
  EXPECT_GT(cv::norm(pattern->left, plain->left, cv::NORM_INF), 20.0);
}

TEST_F(SimCamera, SeesTheTableAtItsAngle) {
  ASSERT_TRUE(rig_->turntable().rotate_to({0.0}, soon()));
  const auto before = expose(Light::plain);
  ASSERT_TRUE(rig_->turntable().rotate_to({90.0}, soon()));
  const auto after = expose(Light::plain);
  ASSERT_TRUE(before && after);
  EXPECT_GT(cv::norm(before->left, after->left, cv::NORM_L1) / 12288.0, 3.0);
}

TEST_F(SimCamera, RefusesToCollectWithoutArming) {
  EXPECT_TRUE(fails_with(rig_->camera().collect(soon()), ErrorCode::protocol));
  ASSERT_TRUE(expose(Light::plain));
  EXPECT_TRUE(fails_with(rig_->camera().collect(soon()), ErrorCode::protocol));
}

TEST_F(SimCamera, TimesOutWithoutAnEdge) {
  ASSERT_TRUE(rig_->camera().arm(soon()));
  const auto begin = clock_->now();
  EXPECT_TRUE(fails_with(rig_->camera().collect(clock_->within(500ms)), ErrorCode::timeout));
  EXPECT_EQ(clock_->now() - begin, 500ms);
}

TEST_F(SimCamera, TimesOutWhenTheFramesAreLostAndRecovers) {
  rig_->lose_frames(1);
  EXPECT_TRUE(fails_with(expose(Light::plain), ErrorCode::timeout));
  EXPECT_TRUE(expose(Light::plain));
}

TEST_F(SimCamera, TimesOutWhenTheFramesComeTooLate) {
  ASSERT_TRUE(rig_->camera().arm(soon()));
  ASSERT_TRUE(rig_->projector().fire(Light::plain, soon()));
  EXPECT_TRUE(fails_with(rig_->camera().collect(clock_->within(5ms)), ErrorCode::timeout));
}

TEST_F(SimCamera, DiscardsFramesOlderThanArming) {
  ASSERT_TRUE(rig_->camera().arm(soon()));
  ASSERT_TRUE(rig_->projector().fire(Light::plain, soon()));
  ASSERT_TRUE(rig_->camera().arm(soon()));
  EXPECT_TRUE(fails_with(rig_->camera().collect(clock_->within(1s)), ErrorCode::timeout));
}

using SimProjector = Rig;

TEST_F(SimProjector, TakesTheTimeOfThePulse) {
  const auto begin = clock_->now();
  ASSERT_TRUE(rig_->projector().fire(Light::pattern, soon()));
  EXPECT_EQ(clock_->now() - begin, 12ms);
  EXPECT_TRUE(rig_->projector().turn_off(soon()));
}

TEST_F(SimProjector, TimesOutIfThePulseIsLongerThanItMayTake) {
  EXPECT_TRUE(fails_with(rig_->projector().fire(Light::pattern, clock_->within(5ms)), ErrorCode::timeout));
}

TEST_F(SimProjector, GoesDarkOnRequestAndTheExposureIsVoid) {
  ASSERT_TRUE(rig_->camera().arm(soon()));
  clock_->at(3ms, [] { rig_->projector().request_off(); });
  EXPECT_TRUE(fails_with(rig_->projector().fire(Light::pattern, soon()), ErrorCode::io));
  EXPECT_TRUE(fails_with(rig_->camera().collect(clock_->within(1s)), ErrorCode::timeout));
}

using SimPanel = Rig;

TEST_F(SimPanel, ReportsAPressOnceAndThenTheRelease) {
  PanelInputs known;
  clock_->at(2s, [] { rig_->press_start(); });
  const auto begin = clock_->now();
  auto inputs = rig_->panel().wait_change(known, soon());
  EXPECT_EQ(clock_->now() - begin, 2s);
  EXPECT_TRUE(inputs->start);
  inputs = rig_->panel().wait_change(*inputs, soon());
  EXPECT_EQ(*inputs, known);
}

TEST_F(SimPanel, DoesNotLoseAPressWithoutAWaitingReader) {
  rig_->press_stop();
  clock_->sleep_for(10s);
  EXPECT_TRUE(rig_->panel().wait_change({}, soon())->stop);
  EXPECT_FALSE(rig_->panel().wait_change({}, clock_->within(0s))->stop);
}

TEST_F(SimPanel, ReturnsTheSameInputsAtTheDeadline) {
  const auto begin = clock_->now();
  EXPECT_EQ(*rig_->panel().wait_change({}, clock_->within(1s)), PanelInputs{});
  EXPECT_EQ(clock_->now() - begin, 1s);
}

TEST_F(SimPanel, ReportsTheEmergencyStopAsLongAsItIsPressed) {
  rig_->set_estop(false);
  EXPECT_FALSE(rig_->panel().wait_change({}, soon())->estop_ok);
  EXPECT_FALSE(rig_->panel().wait_change({}, soon())->estop_ok);
}

TEST_F(SimPanel, LightsItsLamps) {
  PanelOutputs outputs;
  outputs.flip_request = true;
  ASSERT_TRUE(rig_->panel().show(outputs, soon()));
  EXPECT_EQ(rig_->lamps(), outputs);
}

TEST(SimRigTruth, HoldsTheTrueAnglesOfTheLatestPosesAndNoViewTwice) {
  ManualClock clock;
  SimRigOptions options;
  options.image_scale = 0.1;
  auto rig = SimRig::create(options, clock).value();
  const auto folder = own_folder();
  std::filesystem::create_directories(folder);
  EXPECT_EQ(rig->write_truth(folder).error().code, ErrorCode::degenerate);
  std::vector<double> measured;
  for (int pose = 0; pose < 2; ++pose) {
    ASSERT_TRUE(rig->turntable().home(clock.within(60s)));
    for (const double angle : {0.0, 120.0, 120.0, 240.0}) {  // one view is taken again
      const auto move = rig->turntable().rotate_to({angle}, clock.within(60s));
      for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(rig->camera().arm(clock.within(1s)));
        ASSERT_TRUE(rig->projector().fire(i ? Light::plain : Light::pattern, clock.within(1s)));
      }
      measured.push_back(move->measured.value);
    }
    if (pose == 0) rig->turn_over();
  }
  ASSERT_TRUE(rig->write_truth(folder));
  ASSERT_TRUE(rig->write_calibration(folder / "calibration.json"));
  const auto truth = nlohmann::json::parse(read_file(folder / "truth.json").value());
  ASSERT_EQ(truth["poses"].size(), 2U);
  for (int pose = 0; pose < 2; ++pose) {
    const auto& angles = truth["poses"][pose]["angles_deg"];
    ASSERT_EQ(angles.size(), 3U);
    EXPECT_NEAR(angles[1], measured[4 * pose + 2], 0.002 + 1e-9);  // half a step of the encoder
  }
  EXPECT_EQ(truth["poses"][0]["table_from_truth"]["translation"], nlohmann::json({0.0, 0.0, 0.0}));
  EXPECT_EQ(truth["profile_sha256"], rig->profile_sha256());
  EXPECT_TRUE(std::filesystem::exists(folder / "truth.ply"));
  std::filesystem::remove_all(folder);
  EXPECT_EQ(rig->write_truth(folder).error().code, ErrorCode::io);
}

TEST(SimRigCreation, RefusesAnUnsuitableObject) {
  ManualClock clock;
  SimRigOptions options;
  options.object = "/nonexistent/teapot.obj";
  EXPECT_EQ(SimRig::create(options, clock).error().code, ErrorCode::not_found);
  options = {};
  options.height_mm = 200.0;
  EXPECT_EQ(SimRig::create(options, clock).error().code, ErrorCode::invalid_input);
  options = {};
  options.image_scale = 7.0;
  EXPECT_EQ(SimRig::create(options, clock).error().code, ErrorCode::out_of_range);
}

}  // namespace
}  // namespace scanrig::sim
