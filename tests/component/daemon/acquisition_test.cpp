#include "daemon/rig/acquisition.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/virtual_clock.h"
#include "tests/component/daemon/fake_rig.h"

namespace scanrig {
namespace {

class AcquisitionTest : public testing::Test {
 protected:
  VirtualClock clock;
  fakes::FakeRig rig{clock};
  Acquisition acquisition{rig.devices(), clock, {}};
};

TEST_F(AcquisitionTest, AViewIsFourImagesAtTheAngleMeasured) {
  ASSERT_TRUE(acquisition.home());
  const auto view = acquisition.take_view({"job", 0, 1}, {45.0});
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_DOUBLE_EQ(view->record.commanded_deg, 45.0);
  EXPECT_DOUBLE_EQ(view->record.measured_deg, 45.01);
  EXPECT_DOUBLE_EQ(view->record.moving_ms, 1001.0);
  EXPECT_DOUBLE_EQ(view->record.settling_ms, 200.0);
  EXPECT_EQ(view->record.pixel_format, "Mono8");
  EXPECT_EQ(view->images.left_pattern.at<unsigned char>(0, 0), 200);
  EXPECT_EQ(view->images.right_plain.at<unsigned char>(0, 0), 100);
  EXPECT_TRUE(view->record.retake_reasons.empty());
}

TEST_F(AcquisitionTest, TheCamerasGetReadyBeforeTheTableTurnsAndNotWhenItStands) {
  ASSERT_TRUE(acquisition.home());
  clock.sleep_for(std::chrono::seconds(1));
  const auto begun = clock.now();
  ASSERT_TRUE(acquisition.take_view({"job", 0, 1}, {45.0}));
  EXPECT_EQ(rig.line.ready_at, begun);
}

TEST_F(AcquisitionTest, TheSecondPoseGoesOnInTheNextTurn) {
  ASSERT_TRUE(acquisition.home());
  for (const double angle : {0.0, 120.0, 240.0}) ASSERT_TRUE(acquisition.take_view({"job", 0, 0}, {angle}));
  const auto view = acquisition.take_view({"job", 1, 0}, {0.0});
  ASSERT_TRUE(view);
  EXPECT_EQ(rig.turntable.targets.back(), 360.0);
  EXPECT_NEAR(view->record.measured_deg, 0.01, 1e-9);
}

TEST_F(AcquisitionTest, ATableWoundUpByManyJobsIsUnwound) {
  ASSERT_TRUE(acquisition.home());
  for (int turn = 0; turn < 20; ++turn) {
    for (const double angle : {0.0, 120.0, 240.0}) ASSERT_TRUE(acquisition.take_view({"job", 0, 0}, {angle}));
  }
  EXPECT_LE(std::ranges::max(rig.turntable.targets), 4 * 360.0);
}

TEST_F(AcquisitionTest, ALostExposureIsRedoneAndNamed) {
  ASSERT_TRUE(acquisition.home());
  rig.line.lose = 2;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_TRUE(view);
  ASSERT_EQ(view->record.retake_reasons.size(), 2u);
  EXPECT_EQ(view->record.retake_reasons[0].code, ErrorCode::timeout);
  EXPECT_FALSE(view->record.retake_reasons[0].message.empty());
  EXPECT_EQ(rig.line.exposures, 4);
  EXPECT_EQ(view->images.left_pattern.at<unsigned char>(0, 0), 200) << "the retake is the pattern again";
}

/// Offers every view a longer and a shorter exposure of the pattern.
class ExposuresTest : public testing::Test {
 protected:
  VirtualClock clock;
  fakes::FakeRig rig{clock};
  int shown = 0;
  Acquisition acquisition{
      rig.devices(), clock, {.pattern_factors = {8.0, 0.25}}, [this](const StereoFrame&) { ++shown; }};
};

TEST_F(ExposuresTest, ADarkViewIsExposedLongerToo) {
  ASSERT_TRUE(acquisition.home());
  rig.line.light = 15;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_EQ(view->images.more_patterns.size(), 1u);
  EXPECT_EQ(view->images.more_patterns[0].factor, 8.0);
  EXPECT_EQ(view->images.more_patterns[0].right.at<unsigned char>(0, 0), 120);
  EXPECT_EQ(rig.line.factors, (std::vector<double>{1.0, 1.0, 8.0}));
  EXPECT_EQ(rig.line.factor, 1.0) << "previews too are as configured";
  EXPECT_EQ(shown, 2) << "the page shows no overexposed image";
}

TEST_F(ExposuresTest, AnOverexposedPatternIsExposedShorterTooAndAGoodOneOnce) {
  ASSERT_TRUE(acquisition.home());
  rig.line.light = 255;
  ASSERT_TRUE(acquisition.take_view({"job", 0, 0}, {0.0}));
  rig.line.light = 200;
  const auto good = acquisition.take_view({"job", 0, 1}, {45.0});
  ASSERT_TRUE(good);
  EXPECT_TRUE(good->images.more_patterns.empty());
  EXPECT_EQ(rig.line.factors, (std::vector<double>{1.0, 1.0, 0.25, 1.0, 1.0}));
}

TEST_F(ExposuresTest, AMovementCheckAndACalibrationTakeNoMore) {
  ASSERT_TRUE(acquisition.home());
  rig.line.light = 15;
  ASSERT_TRUE(acquisition.take_view({"job", 0, 0}, {0.0}, ViewExposures::one_pattern));
  ASSERT_TRUE(acquisition.take_view({"job", 0, 0}, {0.0}, ViewExposures::plain_only));
  EXPECT_EQ(rig.line.exposures, 3);
}

TEST_F(ExposuresTest, CamerasWithOneExposureSayWhatToDo) {
  ASSERT_TRUE(acquisition.home());
  rig.line.light = 15;
  rig.line.has_one_exposure = true;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, ErrorCode::unsupported);
  EXPECT_NE(view.error().message.find("pattern_exposures_us"), std::string::npos);
}

TEST_F(ExposuresTest, ALostLongExposureIsTakenAgainAndTheNextViewIsAsConfigured) {
  ASSERT_TRUE(acquisition.home());
  rig.line.light = 15;
  rig.line.fires_before = 2;
  rig.line.at_fire = [this] {
    const std::lock_guard guard(rig.line.mutex);
    rig.line.lose = 1;
  };
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->record.retake_reasons.size(), 1u);
  EXPECT_EQ(rig.line.factors, (std::vector<double>{1.0, 1.0, 8.0, 8.0}));
  EXPECT_EQ(rig.line.factor, 1.0);
}

TEST_F(AcquisitionTest, ACameraThatStaysSilentFailsTheView) {
  ASSERT_TRUE(acquisition.home());
  rig.line.lose = 100;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, ErrorCode::timeout);
  EXPECT_EQ(rig.line.exposures, 4) << "one and three retakes";
}

TEST_F(AcquisitionTest, ADarkPictureIsRedoneAndFailsTheViewByNameWhenItStaysDark) {
  ASSERT_TRUE(acquisition.home());
  rig.line.dark = 3;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_EQ(view->record.retake_reasons.size(), 3u);
  EXPECT_TRUE(view->record.retake_reasons.back().message.starts_with("right camera: the pattern image is dark"));
  rig.line.dark = 100;
  const auto next = acquisition.take_view({"job", 0, 1}, {45.0});
  ASSERT_FALSE(next);
  EXPECT_EQ(next.error().code, ErrorCode::protocol);
  EXPECT_TRUE(next.error().message.starts_with("right camera: the pattern image is dark")) << next.error().message;
}

TEST_F(AcquisitionTest, AnExposureDuringWhichTheCameraVanishedIsRedone) {
  ASSERT_TRUE(acquisition.home());
  rig.line.absent = 2;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_EQ(view->record.retake_reasons.size(), 2u);
  EXPECT_EQ(view->record.retake_reasons[0].message, "left camera 4711: no answer");
}

TEST_F(AcquisitionTest, ACameraThatStaysAwayFailsTheViewByItsName) {
  ASSERT_TRUE(acquisition.home());
  rig.line.absent = -1;
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().message, "left camera 4711: no answer");
  EXPECT_EQ(acquisition.check().devices.at(2).problem->message, "left camera 4711: no answer");
  rig.line.absent = 0;
  EXPECT_FALSE(acquisition.check().devices.at(2).problem);
  EXPECT_TRUE(acquisition.take_view({"job", 0, 0}, {0.0}));
}

/// A projector that a camera fires: it can be switched off once the cameras have been prepared.
class FiredByCamera final : public Projector {
 public:
  explicit FiredByCamera(const fakes::TriggerLine& line) : line_(line) {}
  Result<void> fire(Light, Deadline) override { return {}; }
  Result<void> turn_off(Deadline) override {
    if (line_.ready_at == Clock::TimePoint{}) return fail(ErrorCode::io, "projector: left camera: not connected");
    return {};
  }
  void request_off() noexcept override {}

 private:
  const fakes::TriggerLine& line_;
};

TEST_F(AcquisitionTest, TheFirstCheckFindsAProjectorThatACameraFires) {
  clock.sleep_for(std::chrono::seconds(1));
  FiredByCamera projector(rig.line);
  auto devices = rig.devices();
  Acquisition with_strobe({devices.turntable, projector, devices.camera, devices.panel}, clock, {});
  for (const auto& device : with_strobe.check().devices) EXPECT_FALSE(device.problem) << device.name;
}

TEST_F(AcquisitionTest, AnInterruptedExposureIsNotRedone) {
  ASSERT_TRUE(acquisition.home());
  rig.line.at_fire = [&] {
    acquisition.interrupt();
    rig.projector.request_off();
  };
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, ErrorCode::io);
  EXPECT_EQ(rig.line.exposures, 1);
}

TEST_F(AcquisitionTest, NothingIsExposedAfterAnInterrupt) {
  ASSERT_TRUE(acquisition.home());
  rig.line.at_fire = [&] { acquisition.interrupt(); };
  const auto view = acquisition.take_view({"job", 0, 0}, {0.0});
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, ErrorCode::stopped);
  EXPECT_EQ(rig.line.exposures, 1) << "the plain exposure was still to come";
}

TEST_F(AcquisitionTest, FailuresOfTheTurntableArePassedOn) {
  EXPECT_EQ(acquisition.take_view({"job", 0, 0}, {0.0}).error().code, ErrorCode::not_homed);
  ASSERT_TRUE(acquisition.home());
  rig.turntable.stalled = true;
  EXPECT_EQ(acquisition.take_view({"job", 0, 1}, {45.0}).error().code, ErrorCode::stalled);
  rig.turntable.unreachable = true;
  EXPECT_EQ(acquisition.stop().table.error().code, ErrorCode::timeout);
}

}  // namespace
}  // namespace scanrig
