#include <gmock/gmock.h>

#include <fstream>
#include <thread>

#include "tests/component/camera/stereo_camera_compliance.h"
#include "tests/component/camera/v4l2_bench.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

std::unique_ptr<StereoCameraBench> two_devices() { return std::make_unique<V4l2Bench>(); }
std::unique_ptr<StereoCameraBench> side_by_side() { return std::make_unique<V4l2Bench>(true); }

INSTANTIATE_TEST_SUITE_P(V4l2, StereoCameraCompliance, testing::Values(&two_devices, &side_by_side));

/// Error of opening after `change`.
Error refused(const V4l2Bench::Change& change) {
  const V4l2Bench bench(false, change);
  EXPECT_FALSE(bench.opened());
  return bench.opened() ? Error{} : bench.opened().error();
}

TEST(V4l2Camera, ADeviceThatIsNotThereIsNamed) {
  const auto error = refused([](auto& options, auto&) { options.right->device = "/dev/elsewhere"; });
  EXPECT_EQ(error.code, ErrorCode::not_found);
  EXPECT_THAT(error.message, HasSubstr("right camera /dev/elsewhere"));
}

TEST(V4l2Camera, ADeviceInUseIsAnIoError) {
  const auto error = refused([](auto& options, auto&) { options.right->device = options.left.device; });
  EXPECT_EQ(error.code, ErrorCode::io);
}

TEST(V4l2Camera, AnOutputDeviceIsUnsupported) {
  const auto error = refused([](auto&, auto& video) { video.capabilities = V4L2_CAP_VIDEO_OUTPUT; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
}

TEST(V4l2Camera, AnotherSizeThanAskedForIsUnsupported) {
  const auto error = refused([](auto&, auto& video) { video.other_size = true; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_THAT(error.message, HasSubstr("1234"));
}

TEST(V4l2Camera, AnUnknownPixelFormatIsUnsupported) {
  const auto error = refused([](auto& options, auto&) { options.pixel_format = "H264"; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
}

TEST(V4l2Camera, AControlOutOfRangeIsInvalid) {
  const auto error = refused([](auto& options, auto& video) {
    video.known[V4L2_CID_GAIN] = 0;
    video.limit[V4L2_CID_GAIN] = 10;
    options.gain = 11;
  });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("to 11"));
}

TEST(V4l2Camera, AControlThatIsAskedForMustExist) {
  const auto error = refused([](auto& options, auto&) { options.controls[0x0199e201] = 1; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("0x0199E201"));
}

TEST(V4l2Camera, ExposureIsManualAndFocusFixed) {
  V4l2Bench bench(false, [](auto&, auto& video) {
    video.known = {{V4L2_CID_EXPOSURE_AUTO, 3}, {V4L2_CID_EXPOSURE_ABSOLUTE, 1}, {V4L2_CID_FOCUS_AUTO, 1}};
  });
  EXPECT_EQ(bench.video().known[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(bench.video().known[V4L2_CID_EXPOSURE_ABSOLUTE], 20);  // units of 100 us
  EXPECT_EQ(bench.video().known[V4L2_CID_FOCUS_AUTO], 0);
}

TEST(V4l2Camera, AnExposureIsScaledFromTheConfiguredOne) {
  V4l2Bench bench(false, [](auto&, auto& video) { video.known = {{V4L2_CID_EXPOSURE_ABSOLUTE, 1}}; });
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  const auto scaled = [&](double factor) {
    return bench.camera().scale_exposure(factor, Deadline::after(bench.clock(), std::chrono::seconds(1)));
  };
  ASSERT_TRUE(scaled(8.0));
  EXPECT_EQ(bench.video().known[V4L2_CID_EXPOSURE_ABSOLUTE], 160);
  ASSERT_TRUE(scaled(1.0));
  EXPECT_EQ(bench.video().known[V4L2_CID_EXPOSURE_ABSOLUTE], 20);
  bench.video().limit[V4L2_CID_EXPOSURE_ABSOLUTE] = 100;
  const auto refused = scaled(8.0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
}

TEST(V4l2Camera, WhiteBalanceAndGainAreNotLeftToTheDevice) {
  V4l2Bench bench(false, [](auto& options, auto& video) {
    video.known = {{V4L2_CID_AUTO_WHITE_BALANCE, 1}, {V4L2_CID_AUTOGAIN, 1}, {V4L2_CID_GAIN, 3}};
    options.gain = 7;
  });
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  EXPECT_EQ(bench.video().known[V4L2_CID_AUTO_WHITE_BALANCE], 0);
  EXPECT_EQ(bench.video().known[V4L2_CID_AUTOGAIN], 0);
  EXPECT_EQ(bench.video().known[V4L2_CID_GAIN], 7);
}

TEST(V4l2Camera, AnExposureThatIsRoundedFarIsNamed) {
  const auto rounded = [](int step) {
    return [step](auto&, auto& video) {
      video.known[V4L2_CID_EXPOSURE_ABSOLUTE] = 156;
      video.step[V4L2_CID_EXPOSURE_ABSOLUTE] = step;
    };
  };
  const V4l2Bench close(false, rounded(19));  // of 20 units
  EXPECT_TRUE(close.opened()) << close.opened().error().message;
  const auto error = refused(rounded(16));
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("/dev/left: asked for an exposure in units of 100 us (20) it has 16"));
}

TEST(V4l2Camera, AnExposureThatATriggerModeChangesIsNamed) {
  const auto error = refused([](auto& options, auto& video) {
    video.known = {{V4L2_CID_EXPOSURE_ABSOLUTE, 156}, {0x0199e201, 0}};
    video.side_effects[0x0199e201] = {V4L2_CID_EXPOSURE_ABSOLUTE, 500};
    options.controls[0x0199e201] = 1;
  });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("it has 500"));
}

TEST(V4l2Camera, AGainOrAnAutomaticThatTheDeviceKeepsIsNamed) {
  const auto gain = refused([](auto& options, auto& video) {
    video.known[V4L2_CID_GAIN] = 0;
    video.step[V4L2_CID_GAIN] = 8;
    options.gain = 12;
  });
  EXPECT_THAT(gain.message, HasSubstr("asked for a gain (12) it has 8"));
  const auto automatic = refused([](auto&, auto& video) {
    video.known[V4L2_CID_AUTO_WHITE_BALANCE] = 1;
    video.flags[V4L2_CID_AUTO_WHITE_BALANCE] = V4L2_CTRL_FLAG_READ_ONLY;
  });
  EXPECT_EQ(automatic.code, ErrorCode::invalid_input);
  EXPECT_THAT(automatic.message, HasSubstr("asked for a constant white balance (0) it has 1"));
}

TEST(V4l2Camera, AControlThatCannotBeReadIsWrittenOnly) {
  V4l2Bench bench(false, [](auto& options, auto& video) {
    video.known[0x0199e201] = 0;
    video.flags[0x0199e201] = V4L2_CTRL_FLAG_WRITE_ONLY;
    options.controls[0x0199e201] = 1;
  });
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  EXPECT_EQ(bench.video().known[0x0199e201], 1);
}

TEST(V4l2Camera, ASizeThatIsConfirmedAndNotKeptIsUnsupported) {
  const auto error = refused([](auto&, auto& video) { video.keeps_other_size = true; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_THAT(error.message, HasSubstr("1234"));
}

TEST(V4l2Camera, WallClockStampsAreUnsupported) {
  V4l2Bench bench(false, [](auto&, auto& video) { video.stamps = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN; });
  ASSERT_TRUE(bench.opened());
  const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(1));
  ASSERT_TRUE(bench.camera().arm(deadline));
  bench.fire();
  const auto frame = bench.camera().collect(deadline);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::unsupported);
}

TEST(V4l2Camera, IsFoundByItsSerialNumber) {
  const auto folder = std::filesystem::path(testing::TempDir()) / ("by-id" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const auto link = folder / "usb-Maker_Model_0042-video-index0";
  std::ofstream(link).put('\n');
  const auto change = [&](const char* serial) {
    return [&, serial](V4l2Options& options, ScriptedVideo& video) {
      video.add(link.string());
      options.by_id = folder;
      options.left = {serial, ""};
    };
  };
  const V4l2Bench found(false, change("0042"));
  EXPECT_TRUE(found.opened()) << found.opened().error().message;
  const V4l2Bench missing(false, change("42"));
  ASSERT_FALSE(missing.opened());
  EXPECT_EQ(missing.opened().error().code, ErrorCode::not_found);
  std::filesystem::remove_all(folder);
}

TEST(V4l2Camera, AFreeRunningPairBeginsAfterItWasAskedFor) {
  V4l2Bench bench(false, [](auto& options, auto&) { options.external_trigger = false; });
  const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(2));
  ASSERT_TRUE(bench.camera().arm(deadline));
  bench.fire();
  std::jthread sensors([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      bench.fire();
      bench.clock().sleep_for(std::chrono::milliseconds(5));
    }
  });
  const auto asked = bench.clock().now();
  const auto frame = bench.camera().collect(deadline);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_GE(frame->taken, asked);
}

/// One exposure with the left stamp late by this much; "taken", or the error.
std::string expose(V4l2Bench& bench, std::chrono::microseconds left_stamp_off) {
  const auto deadline = Deadline::after(bench.clock(), bench.ample());
  if (const auto armed = bench.camera().arm(deadline); !armed) return armed.error().message;
  bench.put_left_stamp_off(left_stamp_off);
  bench.fire();
  const auto frame = bench.camera().collect(deadline);
  return frame ? "taken" : frame.error().message;
}

using std::chrono::microseconds;
constexpr microseconds kOnTime{0}, kLate{1400}, kLater{2800};

TEST(V4l2Camera, AWrongStampCostsOneExposure) {
  V4l2Bench bench;
  EXPECT_EQ(expose(bench, kOnTime), "taken");
  EXPECT_THAT(expose(bench, kLate), HasSubstr("left and right were exposed 1.40 ms apart"));
  EXPECT_EQ(expose(bench, kOnTime), "taken");
}

TEST(V4l2Camera, AWrongStampOfTheFirstPairCostsOneExposure) {
  V4l2Bench bench;
  EXPECT_EQ(expose(bench, kLate), "taken") << "it can be compared with none";
  EXPECT_THAT(expose(bench, kOnTime), HasSubstr("apart"));
  EXPECT_EQ(expose(bench, kOnTime), "taken");
  EXPECT_EQ(expose(bench, kOnTime), "taken");
  EXPECT_THAT(expose(bench, kLate), HasSubstr("apart"));
}

TEST(V4l2Camera, APairThatAgreesWithNoneBeforeIsRefused) {
  V4l2Bench bench;
  EXPECT_EQ(expose(bench, kOnTime), "taken");
  EXPECT_THAT(expose(bench, kLate), HasSubstr("apart"));
  EXPECT_THAT(expose(bench, kLater), HasSubstr("apart"));
  EXPECT_THAT(expose(bench, kLate), HasSubstr("apart"));
  EXPECT_EQ(expose(bench, kOnTime), "taken");
}

TEST(V4l2Camera, GivesItsDevicesBack) {
  auto bench = std::make_unique<V4l2Bench>();
  EXPECT_EQ(bench->video().open_descriptors(), 2);
  bench->plug(false);
  EXPECT_FALSE(bench->camera().arm(Deadline::after(bench->clock(), std::chrono::seconds(1))) &&
               bench->camera().collect(Deadline::after(bench->clock(), std::chrono::seconds(1))));
  std::ignore = bench->camera().arm(Deadline::after(bench->clock(), std::chrono::seconds(1)));
  EXPECT_EQ(bench->video().open_descriptors(), 1);
}

}  // namespace
}  // namespace scanrig
