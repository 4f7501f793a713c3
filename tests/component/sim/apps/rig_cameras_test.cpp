#include "sim/apps/rig_cameras.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "config/gpio_options.h"
#include "config/rig_config.h"
#include "core/files.h"
#include "core/units.h"
#include "drivers/camera/aravis_stereo_camera.h"
#include "drivers/projector/gpio_projector.h"
#include "drivers/turntable/modbus_turntable.h"
#include "sim/apps/rig_control.h"
#include "sim/apps/wire_rig.h"
#include "sim/scene/rest_error.h"
#include "tests/own_folder.h"
#include "tests/slowness.h"

namespace scanrig::sim {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

/// A block with one corner cut off: no two of its sides are alike.
constexpr const char* kBlock =
    "v 0 0 0\nv 60 0 0\nv 60 0 40\nv 0 0 40\nv 0 30 0\nv 40 30 0\nv 40 30 40\nv 0 30 40\n"
    "f 1 2 3\nf 1 3 4\nf 5 8 7\nf 5 7 6\nf 1 5 6\nf 1 6 2\nf 2 6 7\nf 2 7 3\nf 3 7 8\nf 3 8 4\nf 4 8 5\nf 4 5 1\n";

/// The simulated rig in this process, and the shipped drivers at the other ends of its wires.
class RigCamerasTest : public testing::Test {
 protected:
  void SetUp() override { start(false); }
  void TearDown() override {
    close();
    std::filesystem::remove_all(folder_);
  }
  void close() {
    camera_.reset();
    projector_.reset();
    lines_.reset();
    rig_.reset();
  }
  void start(bool numbered) {
    close();
    std::filesystem::remove_all(folder_);
    ASSERT_TRUE(create_directories_synced(folder_));
    ASSERT_TRUE(write_file_atomically(scene_.object, kBlock));
    WireRigOptions options;
    options.toml = {.folder = folder_, .drive = "leadshine-rs", .panel = "gpio", .cameras = "gige"};
    options.toml.speed_deg_s = 180;
    options.toml.acceleration_deg_s2 = 2000;
    options.toml.views = 3;
    options.axis.start_deg = 20;
    options.scene = scene_;
    options.numbered_frames = numbered;
    auto rig = WireRig::start(options, clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = std::move(*rig);
    ASSERT_TRUE(rig_->cameras()->wait_until_ready({}));
    const auto config = config::read_rig_config(folder_ / "rig.toml");
    ASSERT_TRUE(config) << config.error().message;
    config_ = *config;
    // A frame is sent when it is rendered; the first after a flip waits for a new scene, too.
    config_.stereo_camera.aravis.frame_timeout = kSlowness * milliseconds(1500);
    lines_ = gpio::socket_lines(folder_ / "gpio.sock", clock_);
    projector_ = GpioProjector::open(config::gpio_projector_options(config_.projector), *lines_, clock_).value();
    auto camera = open_aravis(config_.stereo_camera.aravis, clock_, within(seconds(10)));
    ASSERT_TRUE(camera) << camera.error().message;
    camera_ = std::move(*camera);
  }
  Deadline within(Clock::Duration time) { return Deadline::after(clock_, kSlowness * time); }
  Result<StereoFrame> expose(Light light) {
    if (auto armed = camera_->arm(within(seconds(2))); !armed) return pass_on(armed);
    if (auto fired = projector_->fire(light, within(seconds(2))); !fired) return pass_on(fired);
    return camera_->collect(within(seconds(2)));
  }
  json send(const json& request) { return json::parse(RigControl(*rig_, clock_).reply_to(request.dump())); }
  static double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

  RealClock clock_;
  const std::filesystem::path folder_ = own_folder("eyes_");
  const SceneOptions scene_{.object = folder_ / "block.obj", .height_mm = 70, .seed = 3, .image_scale = 0.1};
  std::unique_ptr<WireRig> rig_;
  config::RigConfig config_;
  std::unique_ptr<gpio::Lines> lines_;
  std::unique_ptr<GpioProjector> projector_;
  std::unique_ptr<SensorCamera> camera_;
};

TEST_F(RigCamerasTest, AFrameShowsTheSceneAtTheTablesRestPositionBitByBit) {
  auto table = ModbusTurntable::create(config_.turntable.modbus, clock_).value();
  ASSERT_TRUE(table->home(within(seconds(20))));
  const auto move = table->rotate_to({120}, within(seconds(10)));
  ASSERT_TRUE(move);
  const double rest = resting_angle(120, scene_.seed);
  EXPECT_EQ(move->measured.value, encoder_reading(rest));
  const auto pattern = expose(Light::pattern), plain = expose(Light::plain);
  ASSERT_TRUE(pattern) << pattern.error().message;
  ASSERT_TRUE(plain) << plain.error().message;

  auto scene = Scene::create(scene_).value();
  const auto true_pattern = scene->shoot(0, to_radians(rest), true, 1);
  const auto true_plain = scene->shoot(0, to_radians(rest), false, 2);
  EXPECT_EQ(pattern->format, PixelFormat::bayer_rggb8);
  EXPECT_EQ(difference(pattern->left, true_pattern.left), 0);
  EXPECT_EQ(difference(pattern->right, true_pattern.right), 0);
  EXPECT_EQ(difference(plain->left, true_plain.left), 0);
  EXPECT_EQ(difference(plain->right, true_plain.right), 0);
}

TEST_F(RigCamerasTest, AnExposureWhoseLightWentOutEarlyIsDark) {
  ASSERT_TRUE(camera_->arm(within(seconds(2))));
  const auto line = lines_->output({"PROJ_TRIG", false}).value();
  ASSERT_TRUE(line->set(true));
  ASSERT_TRUE(line->set(false));
  const auto frame = camera_->collect(within(seconds(2)));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(cv::countNonZero(frame->left), 0);
  EXPECT_EQ(send({{"get", "exposures"}})["exposures"][0]["lit"], false);
}

TEST_F(RigCamerasTest, ReportsStartEndAndReadoutOfEachExposure) {
  ASSERT_TRUE(expose(Light::pattern));
  ASSERT_TRUE(expose(Light::plain));
  const auto all = send({{"get", "exposures"}})["exposures"];
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0]["pattern"], true);
  EXPECT_EQ(all[1]["pattern"], false);
  for (const auto& each : all) {
    EXPECT_EQ(each["ended_ns"].get<std::int64_t>() - each["at_ns"].get<std::int64_t>(), 12'000'000);
    EXPECT_GE(each["read_ns"].get<std::int64_t>() - each["ended_ns"].get<std::int64_t>(), 25'000'000);
  }
  EXPECT_EQ(send({{"get", "exposures"}, {"since", 1}})["exposures"].size(), 1u);
}

TEST_F(RigCamerasTest, ALostFrameIsNamedAndTheNextExposureIsSound) {
  send({{"set", {{"camera_fault", "lost"}, {"camera", "right"}}}});
  const auto lost = expose(Light::pattern);
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::timeout);
  EXPECT_THAT(lost.error().message, HasSubstr("right camera SIM-R"));
  EXPECT_TRUE(expose(Light::pattern));
}

TEST_F(RigCamerasTest, WritesTheNumberOfTheEdgeIntoEveryFrameOnRequest) {
  start(true);
  ASSERT_TRUE(expose(Light::plain));
  const auto second = expose(Light::plain);
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(faint_number(second->left), 2u);
  EXPECT_EQ(faint_number(second->right), 2u);
}

TEST_F(RigCamerasTest, ShowsTheOtherSideAfterTheFlipAndWritesTheTruthOfBoth) {
  EXPECT_THAT(send({{"write_truth", folder_}})["error"], HasSubstr("no exposure"));
  const auto before = expose(Light::plain);
  EXPECT_EQ(send({{"turn_over", true}})["ok"], true);
  const auto after = expose(Light::plain);
  ASSERT_TRUE(before) << before.error().message;
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_GT(difference(before->left, after->left), 40);
  EXPECT_EQ(send({{"write_truth", folder_}})["ok"], true);
  const auto truth = json::parse(*read_file(folder_ / "truth.json"));
  EXPECT_EQ(truth["poses"].size(), 2u);
  EXPECT_TRUE(truth.contains("pose1_from_pose2"));
  EXPECT_EQ(json::parse(*read_file(config_.calibration_file))["left"]["width"], 128);
}

TEST_F(RigCamerasTest, AnUnpluggedCameraIsLostAndComesBack) {
  ASSERT_TRUE(expose(Light::plain));
  send({{"set", {{"camera_unplugged", true}, {"camera", "left"}}}});
  EXPECT_FALSE(expose(Light::plain));
  send({{"set", {{"camera_unplugged", false}, {"camera", "left"}}}});
  const auto by = within(seconds(20));
  auto back = expose(Light::plain);
  while (!back && !by.expired(clock_)) back = expose(Light::plain);
  EXPECT_TRUE(back) << back.error().message;
}

TEST_F(RigCamerasTest, TheLightsAreAsStrongAsTheyAreSet) {
  const auto mean = [](const cv::Mat& image) { return cv::mean(image)[0]; };
  const auto pattern = expose(Light::pattern), plain = expose(Light::plain);
  ASSERT_TRUE(pattern && plain);
  EXPECT_EQ(cv::countNonZero(camera_->capture_preview(within(seconds(2))).value().left), 0);

  send({{"set", {{"light", {{"pattern", 0}, {"plain", 0.5}, {"room", 0.25}}}}}});
  const auto room = camera_->capture_preview(within(seconds(2))), without = expose(Light::pattern),
             half = expose(Light::plain);
  ASSERT_TRUE(room && without && half);
  EXPECT_NEAR(mean(room->left), 0.25 * mean(plain->left), 0.02 * mean(plain->left));
  EXPECT_NEAR(mean(without->right), 0.25 * mean(plain->right), 0.02 * mean(plain->right));
  EXPECT_NEAR(mean(half->left), 0.75 * mean(plain->left), 0.02 * mean(plain->left));

  send({{"set", {{"light", {{"slide", false}}}}}});
  const auto even = expose(Light::pattern);
  ASSERT_TRUE(even);
  EXPECT_NEAR(mean(even->left), mean(plain->left), 0.02 * mean(plain->left));
  send({{"set", {{"light", json::object()}}}});
  EXPECT_NEAR(mean(expose(Light::pattern).value().left), mean(pattern->left), 0.1);
}

TEST_F(RigCamerasTest, ACameraMayExposeShorterThanRequested) {
  WireRigOptions options;
  options.toml = {.folder = folder_, .drive = "leadshine-rs", .panel = "gpio", .cameras = "gige"};
  options.scene = scene_;
  options.max_exposure_us = 8000;
  close();
  rig_ = WireRig::start(options, clock_).value();
  const auto refused = open_aravis(config_.stereo_camera.aravis, clock_, within(seconds(10)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(refused.error().message, HasSubstr("asked for an exposure of 12000 us it takes 8000"));
}

TEST_F(RigCamerasTest, AnInvalidRequestIsNamed) {
  EXPECT_THAT(send({{"set", {{"camera_fault", "lost"}}}})["error"], HasSubstr("left or right"));
  EXPECT_THAT(send({{"set", {{"camera_fault", "tired"}, {"camera", "left"}}}})["error"], HasSubstr("no camera fault"));
  WireRigOptions blind;
  blind.toml = {.folder = folder_ / "blind", .drive = "leadshine-rs", .panel = "gpio"};
  const auto rig = WireRig::start(blind, clock_).value();
  RigControl control(*rig, clock_);
  EXPECT_THAT(control.reply_to(R"({"turn_over":true})"), HasSubstr("--cameras gige"));
  EXPECT_THAT(control.reply_to(R"({"get":"exposures"})"), HasSubstr("--cameras gige"));
}

}  // namespace
}  // namespace scanrig::sim
