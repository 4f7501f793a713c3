#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "tests/component/camera/aravis_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

Result<StereoFrame> expose(AravisBench& bench) {
  if (!bench.opened()) return pass_on(bench.opened());
  const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(5));
  if (auto armed = bench.camera().arm(deadline); !armed) return pass_on(armed);
  bench.fire();
  return bench.camera().collect(deadline);
}

/// Error of opening after `change`.
Error refused(const AravisBench::Change& change) {
  const AravisBench bench(change);
  EXPECT_FALSE(bench.opened());
  return bench.opened() ? Error{} : bench.opened().error();
}

TEST(AravisSetup, CamerasAreFoundByTheirSerialNumbers) {
  AravisBench bench([](auto& options) { options.left.address = options.right.address = ""; });
  const auto frame = expose(bench);
  EXPECT_TRUE(frame) << frame.error().message;
}

TEST(AravisSetup, AnExposureIsScaledForBothAndKeptOverAReconnection) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  const auto deadline = [&] { return Deadline::after(bench.clock(), std::chrono::seconds(8)); };
  const auto exposures = [&] {
    return bench.far().tell("value left ExposureTime") + " " + bench.far().tell("value right ExposureTime");
  };
  ASSERT_EQ(exposures(), "2000 2000");
  ASSERT_TRUE(bench.camera().scale_exposure(8.0, deadline()));
  EXPECT_EQ(exposures(), "16000 16000");
  EXPECT_TRUE(expose(bench));
  const auto until = [&](bool is_there) {
    for (const auto by = deadline(); bench.camera().prepare(deadline()).has_value() != is_there;) {
      if (by.expired(bench.clock())) return false;
      bench.clock().sleep_for(milliseconds(20));
    }
    return true;
  };
  ASSERT_TRUE(bench.plug(false));
  ASSERT_TRUE(until(false)) << "the loss is noticed";
  ASSERT_TRUE(bench.plug(true));
  ASSERT_TRUE(until(true)) << "it is connected again";
  EXPECT_EQ(exposures(), "16000 16000");
  ASSERT_TRUE(bench.camera().scale_exposure(1.0, deadline()));
  EXPECT_EQ(exposures(), "2000 2000");
  EXPECT_TRUE(expose(bench));
}

TEST(AravisSetup, AnotherCameraAtTheAddressIsRefusedByName) {
  const auto error = refused([](auto& options) { options.right.serial = "40019999"; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("40019999"));
  EXPECT_THAT(error.message, HasSubstr("40012346"));
}

TEST(AravisSetup, ASerialNumberNobodyHasIsNotFound) {
  const auto error = refused([](auto& options) { options.left = {"4711", ""}; });
  EXPECT_EQ(error.code, ErrorCode::not_found);
  EXPECT_THAT(error.message, HasSubstr("left camera 4711"));
}

TEST(AravisSetup, AnAddressWithoutACameraIsNotFound) {
  const auto error = refused([](auto& options) { options.left.address = "127.0.0.3"; });
  EXPECT_EQ(error.code, ErrorCode::not_found) << error.message;
}

TEST(AravisSetup, NoTimeToConnectIsATimeout) {
  RealClock clock;
  const auto opened = open_aravis({}, clock, {clock.now()});
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::timeout);
}

TEST(AravisSetup, PacketsLargerThanTheNetworkPassesAreNamed) {
  const auto error = refused([](auto& options) { options.packet_bytes = 70000; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("MTU"));
}

TEST(AravisSetup, APixelFormatTheCameraDoesNotHaveIsUnsupported) {
  const auto error = refused([](auto& options) { options.pixel_format = "Mono12Packed"; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_THAT(error.message, HasSubstr("Mono12Packed"));
}

TEST(AravisSetup, AnEdgeTheCameraCannotUseIsInvalid) {
  const auto error = refused([](auto& options) { options.falling_edge = true; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("FallingEdge"));
}

TEST(AravisSetup, AnInputTheCameraDoesNotHaveIsInvalid) {
  const auto error = refused([](auto& options) { options.trigger_source = "Line7"; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("Line7"));
}

TEST(AravisSetup, PtpThatTheCameraDoesNotHaveIsUnsupported) {
  const auto error = refused([](auto& options) { options.frame_clock = TriggeringOptions::FrameClock::ptp; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
}

TEST(AravisSetup, AnExposureOutOfItsRangeIsInvalid) {
  const auto error = refused([](auto& options) { options.exposure = std::chrono::microseconds(1); });
  EXPECT_EQ(error.code, ErrorCode::invalid_input) << error.message;
}

struct Delivered {
  const char* asked;
  PixelFormat format;
};
class AravisFormats : public testing::TestWithParam<Delivered> {};

TEST_P(AravisFormats, AreHandedOutAsTheInterfaceSays) {
  AravisBench bench([](auto& options) { options.pixel_format = GetParam().asked; });
  const auto frame = expose(bench);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->format, GetParam().format);
  EXPECT_EQ(frame->left.size(), bench.size());
}

INSTANTIATE_TEST_SUITE_P(All, AravisFormats,
                         testing::Values(Delivered{"Mono8", PixelFormat::mono8},
                                         Delivered{"Mono16", PixelFormat::mono8},
                                         Delivered{"BayerRG8", PixelFormat::bayer_rggb8},
                                         Delivered{"BayerGB8", PixelFormat::bgr8},
                                         Delivered{"RGB8", PixelFormat::bgr8}),
                         [](const auto& format) { return format.param.asked; });

TEST(AravisSetup, ARegionIsReadOut) {
  AravisBench bench([](auto& options) { options.region = Region{16, 8, 96, 64}; });
  const auto frame = expose(bench);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->left.size(), cv::Size(96, 64));
}

TEST(AravisSetup, ACameraThatCallsItsTriggerFrameBurstStartIsTriggeredByThat) {
  AravisBench bench([](auto&) {}, 400, "FrameBurstStart");
  const auto frame = expose(bench);
  EXPECT_TRUE(frame) << frame.error().message;
}

TEST(AravisSetup, ACameraThatCallsItsTriggerAcquisitionStartOnlyIsTriggeredByThat) {
  AravisBench bench([](auto&) {}, 400, "AcquisitionStart");
  EXPECT_TRUE(bench.opened()) << bench.opened().error().message;
}

TEST(AravisTriggers, BySoftwareCollectExposes) {
  AravisBench bench([](auto& options) { options.trigger_source = "Software"; });
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  for (int i = 0; i < 5; ++i) {
    const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(5));
    ASSERT_TRUE(bench.camera().arm(deadline));
    const auto asked = bench.clock().now();
    const auto frame = bench.camera().collect(deadline);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_GE(frame->taken, asked);
  }
}

TEST(AravisTriggers, AfterDeadAirAnExposureIsMadeAndThrownAway) {
  AravisBench bench([](auto& options) { options.idle_refresh = std::chrono::seconds(0); });
  ASSERT_TRUE(expose(bench));
  const auto before = bench.camera().counts().warm_up;
  ASSERT_TRUE(expose(bench));
  EXPECT_EQ(bench.camera().counts().warm_up, before + 2);
}

TEST(AravisTriggers, CamerasThatAreReadyNeedNoExposureBeforeTheFirst) {
  AravisBench bench;  // ready once it is open
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  const auto before = bench.camera().counts().warm_up;
  EXPECT_GT(before, 0u);
  ASSERT_TRUE(expose(bench));
  EXPECT_EQ(bench.camera().counts().warm_up, before);
}

TEST(AravisTriggers, AfterDeadAirReadyMakesTheExposureThatArmNeedsNot) {
  AravisBench bench([](auto& options) { options.idle_refresh = std::chrono::seconds(1); });
  ASSERT_TRUE(expose(bench));
  const auto before = bench.camera().counts().warm_up;
  const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(5));
  ASSERT_TRUE(bench.camera().prepare(deadline));
  EXPECT_EQ(bench.camera().counts().warm_up, before) << "no dead air yet";
  bench.clock().sleep_for(milliseconds(1100));  // the idle time itself
  ASSERT_TRUE(bench.camera().prepare(deadline));
  EXPECT_EQ(bench.camera().counts().warm_up, before + 2);
  ASSERT_TRUE(expose(bench));
  EXPECT_EQ(bench.camera().counts().warm_up, before + 2);
}

TEST(AravisTriggers, ALookCostsTheNextExposureNothing) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  ASSERT_TRUE(bench.camera().capture_preview(Deadline::after(bench.clock(), std::chrono::seconds(5))));
  const auto before = bench.camera().counts().warm_up;
  ASSERT_TRUE(expose(bench));
  EXPECT_EQ(bench.camera().counts().warm_up, before);
}

TEST(AravisTriggers, WithoutDeadAirNoneIs) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  const auto before = bench.camera().counts().warm_up;
  ASSERT_TRUE(expose(bench));
  EXPECT_EQ(bench.camera().counts().warm_up, before);
}

std::ptrdiff_t descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

TEST(AravisLoss, NobodyWaitsUntilTheLibraryHasGivenALostCameraUp) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  const auto open = descriptors();
  ASSERT_TRUE(bench.plug(false));
  EXPECT_FALSE(expose(bench));  // a frame that does not come makes the next call check
  const auto begun = bench.clock().now();
  const auto lost = bench.camera().prepare(Deadline::after(bench.clock(), std::chrono::seconds(10)));
  ASSERT_FALSE(lost);
  EXPECT_THAT(lost.error().message, HasSubstr("right camera 40012346"));
  EXPECT_LT(bench.clock().now() - begun, std::chrono::seconds(9)) << "giving it up alone takes ten";
  ASSERT_TRUE(bench.plug(true));
  const auto again = bench.camera().prepare(Deadline::after(bench.clock(), std::chrono::seconds(10)));
  EXPECT_TRUE(again) << again.error().message;
  EXPECT_TRUE(expose(bench));
  const auto given_up = Deadline::after(bench.clock(), std::chrono::seconds(20));
  while (descriptors() > open && !given_up.expired(bench.clock())) bench.clock().sleep_for(milliseconds(20));
  EXPECT_LE(descriptors(), open) << "the lost connection is closed";
}

TEST(AravisTriggers, ACameraThatMissedTheEdgeIsNamed) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  bench.far().tell("fault left missed 1");
  const auto frame = expose(bench);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::timeout);
  EXPECT_THAT(frame.error().message, HasSubstr("left camera 40012345"));
  EXPECT_TRUE(expose(bench));
}

TEST(AravisTriggers, TwoEdgesForOneArmAreAProtocolError) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  const auto deadline = Deadline::after(bench.clock(), std::chrono::seconds(5));
  ASSERT_TRUE(bench.camera().arm(deadline));
  bench.fire();
  bench.clock().sleep_for(milliseconds(30));
  bench.fire();
  bench.clock().sleep_for(milliseconds(30));
  const auto frame = bench.camera().collect(deadline);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::protocol);
  EXPECT_THAT(frame.error().message, HasSubstr("more frames than triggers"));
}

TEST(AravisTriggers, AClockThatIsSetIsNamedAndLearntAnew) {
  for (const char* set : {"clock right 60000", "clock right -60000"}) {
    AravisBench bench;
    const auto before = expose(bench);
    ASSERT_TRUE(before) << before.error().message;
    bench.far().tell(set);
    const auto frame = expose(bench);
    ASSERT_FALSE(frame) << set;
    EXPECT_EQ(frame.error().code, ErrorCode::protocol) << frame.error().message;
    bool recovered = false;
    for (int i = 0; i < 3 && !recovered; ++i) recovered = expose(bench).has_value();
    EXPECT_TRUE(recovered) << set;
  }
}

TEST(AravisEvidence, DarkAndBlurredImagesShow) {
  AravisBench bench;
  const auto good = expose(bench);
  ASSERT_TRUE(good) << good.error().message;
  bench.far().tell("fault left dark 1");
  bench.far().tell("fault right blurred 1");
  const auto bad = expose(bench);
  ASSERT_TRUE(bad) << bad.error().message;
  EXPECT_LT(bad->left_evidence.brightness, 0.5 * good->left_evidence.brightness);
  EXPECT_GT(bad->right_evidence.blur_px, 1.5 * good->right_evidence.blur_px);
  EXPECT_EQ(good->left_evidence.saturated, 0.0);
}

TEST(AravisEvidence, SwappedSensorsShowEachOthersImages) {
  AravisBench bench;
  bench.far().tell("fault left swapped 1");
  bench.far().tell("fault right swapped 1");
  const auto swapped = expose(bench);
  ASSERT_TRUE(swapped) << swapped.error().message;
  cv::Mat left(bench.size(), CV_8U);
  sim::wire::draw_test_image(sim::wire::Side::left, {1, true, {}}, left);
  sim::wire::hide_number(1, left);
  EXPECT_EQ(cv::norm(swapped->right, left, cv::NORM_INF), 0.0);
}

TEST(HostFinding, WhatWouldLoseFramesIsSaidInASentence) {
  const auto root = std::filesystem::path(testing::TempDir()) / ("host" + std::to_string(::getpid()));
  const auto sockets = root / "proc/sys/net/core/rmem_max";
  const auto usb = root / "sys/module/usbcore/parameters/usbfs_memory_mb";
  for (const auto& file : {sockets, usb}) std::filesystem::create_directories(file.parent_path());
  constexpr std::size_t kFrame = 1280 * 960;
  EXPECT_FALSE(host_finding(CameraBus::gige, kFrame, root.string()));
  std::ofstream(sockets) << 212992;
  EXPECT_THAT(host_finding(CameraBus::gige, kFrame, root.string()).value_or(""),
              HasSubstr("net.core.rmem_max to at least 2457600"));
  std::ofstream(sockets) << 8388608;
  EXPECT_FALSE(host_finding(CameraBus::gige, kFrame, root.string()));
  std::ofstream(usb) << 16;
  EXPECT_FALSE(host_finding(CameraBus::usb3, kFrame, root.string()));
  EXPECT_THAT(host_finding(CameraBus::usb3, 5 * kFrame, root.string()).value_or(""), HasSubstr("usbfs_memory_mb"));
  std::ofstream(usb) << 0;
  EXPECT_FALSE(host_finding(CameraBus::usb3, 5 * kFrame, root.string()));
  std::filesystem::remove_all(root);
}

TEST(AravisTriggers, WithoutTheTimeToBeginAnewArmingIsATimeout) {
  AravisBench bench;
  ASSERT_TRUE(expose(bench));
  bench.far().tell("fault left lost 1");
  ASSERT_FALSE(expose(bench));
  const auto armed = bench.camera().arm(Deadline::after(bench.clock(), milliseconds(1)));
  ASSERT_FALSE(armed);
  EXPECT_EQ(armed.error().code, ErrorCode::timeout) << armed.error().message;
  EXPECT_TRUE(expose(bench));
}

}  // namespace
}  // namespace scanrig
