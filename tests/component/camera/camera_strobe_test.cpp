#include <gmock/gmock.h>

#include "tests/component/camera/stereo_camera_compliance.h"
#include "tests/component/camera/strobe_bench.h"
#include "tests/component/projector/projector_compliance.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

std::unique_ptr<StereoCameraBench> make_camera_bench() {
  auto bench = std::make_unique<StrobeBench>();
  EXPECT_TRUE(bench->opened()) << bench->opened().error().message;
  return bench;
}

INSTANTIATE_TEST_SUITE_P(CameraStrobe, StereoCameraCompliance, testing::Values(&make_camera_bench));

class StrobeProjectorBench final : public ProjectorBench {
 public:
  Projector& projector() override { return bench_.projector(); }
  Clock& clock() override { return bench_.clock(); }
  std::vector<Flash> seen() override {
    while (const auto flash = bench_.flash(seen_.size())) seen_.push_back({flash->first, flash->second});
    return seen_;
  }
  bool seen_lit() override { return bench_.is_lit(); }
  void when_lit(std::function<void()> act) override {
    onlooker_ = std::jthread([this, act = std::move(act)](const std::stop_token& stop) {
      while (!stop.stop_requested() && !bench_.is_lit()) std::this_thread::yield();
      if (!stop.stop_requested()) act();
    });
  }
  Clock::Duration exposure() const override { return StrobeBench::kExposure; }
  void plug(bool in) override { bench_.tell(in ? "plug left 1" : "plug left 0"); }

 private:
  StrobeBench bench_;
  std::vector<Flash> seen_;
  std::jthread onlooker_;
};

std::unique_ptr<ProjectorBench> make_projector_bench() { return std::make_unique<StrobeProjectorBench>(); }

INSTANTIATE_TEST_SUITE_P(CameraStrobe, ProjectorCompliance, testing::Values(&make_projector_bench));

/// Error of opening cameras with these outputs.
Error refused(
    const std::string& outputs, const AravisBench::Change& change = [](auto&) {}) {
  const StrobeBench bench(change, outputs);
  EXPECT_FALSE(bench.opened());
  return bench.opened() ? Error{} : bench.opened().error();
}

TEST(CameraStrobeSetup, ACameraWithoutOutputsIsNamed) {
  const auto error = refused("none");
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_THAT(error.message, HasSubstr("left camera 40012345: the camera has no LineSelector"));
}

TEST(CameraStrobeSetup, AnOutputThatCannotFollowTheExposureIsNamed) {
  const auto error = refused("no-exposure-active");
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_THAT(error.message, HasSubstr("left camera 40012345: Line1 has no LineSource ExposureActive"));
}

TEST(CameraStrobeSetup, AnOutputTheCameraDoesNotHaveIsNamed) {
  const auto error = refused("full", [](auto& options) { options.strobe_outputs = {"Line1", "Line7"}; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_THAT(error.message, HasSubstr("left camera 40012345: its LineSelector has no Line7"));
}

TEST(CameraStrobeSetup, TheTriggerInputIsTheRightCameras) {
  const auto error = refused("full", [](auto& options) { options.trigger_source = "Line7"; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("right camera 40012346: set TriggerSource to Line7"));
}

TEST(CameraStrobeSetup, TheRightCameraNeedsNoOutputs) {
  AravisBench bench([](auto&) {}, 400, "FrameStart", "none");
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  EXPECT_FALSE((*bench.opened())->strobe()) << "none is configured";
}

TEST(CameraStrobeSetup, AUserOutputKeepsALineOffThatHasNoOff) {
  StrobeBench bench([](auto&) {}, "user-output");
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  ASSERT_TRUE(bench.fire(Light::plain));
  EXPECT_EQ(bench.flashes(), 1u);
  EXPECT_FALSE(bench.is_lit());
}

class CameraStrobeTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(bench_.opened()) << bench_.opened().error().message; }
  Deadline ample() { return Deadline::after(bench_.clock(), seconds(10)); }
  Result<StereoFrame> expose(Light light) {
    if (auto armed = bench_.camera().arm(ample()); !armed) return pass_on(armed);
    if (auto fired = bench_.fire(light); !fired) return pass_on(fired);
    return bench_.camera().collect(ample());
  }
  /// The cameras are connected again and expose; a first attempt may find the old connection still there.
  void expect_recovery() {
    const auto end = ample();
    auto frame = expose(Light::pattern);
    while (!frame && !end.expired(bench_.clock())) frame = expose(Light::pattern);
    EXPECT_TRUE(frame) << frame.error().message;
  }

  StrobeBench bench_;
};

TEST_F(CameraStrobeTest, BothCamerasSeeTheLightOfTheFire) {
  const auto pattern = expose(Light::pattern), plain = expose(Light::plain);
  ASSERT_TRUE(pattern) << pattern.error().message;
  ASSERT_TRUE(plain) << plain.error().message;
  for (const auto& [bright, dim] : {std::pair(pattern->left_evidence, plain->left_evidence),
                                    std::pair(pattern->right_evidence, plain->right_evidence)}) {
    EXPECT_GT(bright.brightness, 2 * dim.brightness);
  }
}

TEST_F(CameraStrobeTest, ExposuresThatAreNoFireMakeNoLight) {
  EXPECT_EQ(bench_.flashes(), 0u) << "the cameras have been warmed up";
  ASSERT_TRUE(expose(Light::plain));
  ASSERT_TRUE(bench_.camera().capture_preview(ample()));
  bench_.tell("fault right lost 1");
  ASSERT_FALSE(expose(Light::pattern));
  const auto warm = bench_.camera().counts().warm_up;
  ASSERT_TRUE(expose(Light::pattern));
  EXPECT_GT(bench_.camera().counts().warm_up, warm);
  EXPECT_EQ(bench_.flashes(), 3u);
}

TEST_F(CameraStrobeTest, ARightCameraThatTheOutputDoesNotReachIsNamed) {
  ASSERT_TRUE(expose(Light::pattern));
  bench_.tell("fault right missed 1");
  const auto frame = expose(Light::pattern);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::timeout);
  EXPECT_THAT(frame.error().message, HasSubstr("right camera 40012346"));
}

TEST_F(CameraStrobeTest, AFireWithoutArmSpoilsNoExposure) {
  ASSERT_TRUE(bench_.fire(Light::pattern));
  const auto frame = expose(Light::plain);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(bench_.number_in(frame->left), 2u);
  EXPECT_EQ(bench_.number_in(frame->right), 2u);
}

TEST_F(CameraStrobeTest, ACameraThatHangsIsNamedByTheDeadline) {
  ASSERT_TRUE(bench_.camera().arm(ample()));
  bench_.far().freeze(true);
  const auto begun = bench_.clock().now();
  const auto fired = bench_.fire(Light::pattern, milliseconds(1500));
  const auto took = bench_.clock().now() - begun;
  bench_.far().freeze(false);
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::timeout) << fired.error().message;
  EXPECT_THAT(fired.error().message, HasSubstr("projector: left camera 40012345: no reply in time"));
  EXPECT_LT(took, milliseconds(1500));
  // The request that was given up still selects the output. Connected again, the cameras warm up without light.
  const auto end = ample();
  while (!bench_.camera().prepare(ample()) && !end.expired(bench_.clock())) std::this_thread::yield();
  EXPECT_EQ(bench_.flashes(), 0u);
  expect_recovery();
}

TEST_F(CameraStrobeTest, ACameraThatIsGoneIsNamedByTheDeadlineAndComesBack) {
  ASSERT_TRUE(bench_.camera().arm(ample()));
  ASSERT_EQ(bench_.tell("plug left 0"), "ok");
  const auto begun = bench_.clock().now();
  const auto fired = bench_.fire(Light::pattern, milliseconds(1500));
  EXPECT_LT(bench_.clock().now() - begun, milliseconds(1500));
  ASSERT_FALSE(fired);
  EXPECT_THAT(fired.error().message, HasSubstr("projector: left camera 40012345"));
  const auto again = bench_.fire(Light::pattern, milliseconds(1500));
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::io);
  EXPECT_THAT(again.error().message, HasSubstr("not connected; check power and cable"));
  ASSERT_EQ(bench_.tell("plug left 1"), "ok");
  expect_recovery();
}

TEST_F(CameraStrobeTest, AfterAStopDuringAFireTheNextExposureIsGood) {
  ASSERT_TRUE(bench_.camera().arm(ample()));
  std::jthread stop([&] {
    while (!bench_.is_lit()) std::this_thread::yield();
    bench_.projector().request_off();
  });
  const auto fired = bench_.fire(Light::pattern);
  stop.join();
  ASSERT_FALSE(fired);
  EXPECT_FALSE(bench_.is_lit());
  const auto frame = expose(Light::pattern);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(bench_.number_in(frame->left), 2u);
}

}  // namespace
}  // namespace scanrig
