#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "tests/component/camera/aravis_bench.h"

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

using Properties = std::vector<std::string>;

AravisBench bench_with(
    const Properties& properties, const AravisBench::Change& change = [](auto&) {},
    Clock::Duration limit = seconds(10)) {
  Properties all{"exposure-us=2000"};
  all.insert(all.end(), properties.begin(), properties.end());
  return AravisBench(change, 400, "FrameStart", "full", all, limit);
}

Result<StereoFrame> take(AravisBench& bench, bool pattern, std::uint32_t* number = nullptr) {
  if (!bench.opened()) return pass_on(bench.opened());
  const auto deadline = Deadline::after(bench.clock(), seconds(5));
  if (auto armed = bench.camera().arm(deadline); !armed) return pass_on(armed);
  const std::string edge = bench.far().tell(pattern ? "edge 1" : "edge 0");
  if (number) *number = static_cast<std::uint32_t>(std::stoul(edge));
  return bench.camera().collect(deadline);
}

/// What a camera in a sound state shows of an exposure, in the region that is read out.
cv::Mat sound(const AravisBench& bench, sim::wire::Side side, std::uint32_t number, bool pattern,
              const std::optional<Region>& region) {
  cv::Mat image(bench.size(), CV_8U);
  sim::wire::draw_test_image(side, {number, pattern, {}}, image);
  sim::wire::hide_number(number, image);
  return region ? image(cv::Rect(region->x, region->y, region->width, region->height)).clone() : image;
}

class AravisUnknownState : public testing::TestWithParam<int> {};

/// Half of the cameras have a user set Default. A third are read out in part, a third deliver colours.
TEST_P(AravisUnknownState, GivesTheImagesOfASoundStart) {
  const int seed = GetParam();
  std::optional<Region> region;
  if (seed % 3 == 1) region = Region{16, 8, 96, 64};
  const bool colour = seed % 3 == 2;
  auto bench = bench_with({"state=" + std::to_string(seed), seed % 2 == 0 ? "user-sets=yes" : "user-sets=no"},
                          [&](AravisOptions& options) {
                            options.region = region;
                            if (colour) options.pixel_format = "BayerRG8";
                          });
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  for (const bool pattern : {true, false, true}) {
    std::uint32_t number = 0;
    const auto frame = take(bench, pattern, &number);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->format, colour ? PixelFormat::bayer_rggb8 : PixelFormat::mono8);
    for (const auto& [side, image] :
         {std::pair(sim::wire::Side::left, frame->left), std::pair(sim::wire::Side::right, frame->right)}) {
      const cv::Mat expected = sound(bench, side, number, pattern, region);
      ASSERT_EQ(image.size(), expected.size());
      EXPECT_EQ(cv::norm(image, expected, cv::NORM_INF), 0.0) << "exposure " << number;
    }
  }
  for (const char* side : {"left", "right"}) {
    EXPECT_EQ(bench.far().tell(std::string("value ") + side + " ExposureTime"), "2000");
    EXPECT_EQ(bench.far().tell(std::string("value ") + side + " ChunkModeActive"), "0");
    EXPECT_EQ(bench.far().tell(std::string("value ") + side + " TriggerDelay"), "0");
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AravisUnknownState, testing::Range(1, 41));

/// Error of opening cameras with these properties.
Error refused_with(
    const Properties& properties, const AravisBench::Change& change = [](auto&) {},
    Clock::Duration limit = seconds(10)) {
  const auto bench = bench_with(properties, change, limit);
  EXPECT_FALSE(bench.opened());
  return bench.opened() ? Error{} : bench.opened().error();
}

TEST(AravisReadBack, AFeatureThatKeepsItsValueIsNamed) {
  for (const auto& [feature, seed] : {std::pair("GammaEnable", 1), std::pair("Width", 3), std::pair("TriggerDelay", 3),
                                      std::pair("BalanceRatio", 3), std::pair("PixelFormat", 3)}) {
    const auto error = refused_with({"state=" + std::to_string(seed), "user-sets=no", std::string("stuck=") + feature});
    EXPECT_EQ(error.code, ErrorCode::invalid_input) << feature;
    EXPECT_THAT(error.message, HasSubstr(std::string(feature) + " stays "));
    EXPECT_THAT(error.message, HasSubstr("camera 4001234"));
  }
}

TEST(AravisReadBack, AGainThatTheCameraKeepsIsNamed) {
  const auto error = refused_with({"stuck=Gain"}, [](auto& options) { options.gain = 6.0; });
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("asked for a gain of 6 it has 0.00"));
}

TEST(AravisReadBack, AnExposureThatTheCameraKeepsIsNamed) {
  const auto error = refused_with({"stuck=ExposureTime"});
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_THAT(error.message, HasSubstr("asked for an exposure of 2000 us it takes 10000 us"));
}

TEST(AravisReadBack, ABlackLevelIsSetOrItsLackNamed) {
  const auto level = [](auto& options) { options.black_level = 8.0; };
  {
    auto bench = bench_with({}, level);
    ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
    EXPECT_EQ(bench.far().tell("value left BlackLevel"), "8");
  }
  EXPECT_EQ(refused_with({"without=BlackLevel"}, level).code, ErrorCode::unsupported);
}

TEST(AravisReadBack, AGainIsSetWhateverAnAutomaticHadMadeOfIt) {
  auto bench = bench_with({"state=5", "user-sets=no"}, [](auto& options) { options.gain = 6.0; });
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  EXPECT_EQ(bench.far().tell("value right Gain"), "6");
}

TEST(AravisUnknownStates, ACameraThatLacksWhatTheRigDoesNotNeedIsUsed) {
  Properties lacks{"state=8", "user-sets=no"};
  for (const char* feature : {"BinningHorizontal",
                              "BinningVertical",
                              "DecimationHorizontal",
                              "DecimationVertical",
                              "ReverseX",
                              "ReverseY",
                              "ChunkModeActive",
                              "TestPattern",
                              "ExposureAuto",
                              "ExposureMode",
                              "AcquisitionFrameRateEnable",
                              "AcquisitionFrameRate",
                              "TriggerOverlap",
                              "TriggerDelay",
                              "GainAuto",
                              "Gain",
                              "BlackLevel",
                              "BalanceWhiteAuto",
                              "BalanceRatioSelector",
                              "BalanceRatio",
                              "GammaEnable",
                              "Gamma",
                              "LUTEnable"}) {
    lacks.push_back(std::string("without=") + feature);
  }
  auto bench = bench_with(lacks);
  std::uint32_t number = 0;
  const auto frame = take(bench, true, &number);
  ASSERT_TRUE(frame) << frame.error().message;
  const cv::Mat expected = sound(bench, sim::wire::Side::left, number, true, std::nullopt);
  EXPECT_EQ(cv::norm(frame->left, expected, cv::NORM_INF), 0.0);
}

const auto by_ptp = [](AravisOptions& options) { options.frame_clock = TriggeringOptions::FrameClock::ptp; };

TEST(AravisPtp, IsWaitedForAndThenStampsAgree) {
  auto bench = bench_with({"ptp=slave"}, by_ptp);
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  for (int i = 0; i < 3; ++i) {
    const auto frame = take(bench, true);
    EXPECT_TRUE(frame) << frame.error().message;
  }
}

TEST(AravisPtp, ACameraWhoseClockFollowsIsNotMadeToBeginAnew) {
  auto bench = bench_with({"ptp=slave"}, by_ptp);
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  const auto again = bench.open();
  ASSERT_TRUE(bench.opened()) << bench.opened().error().message;
  EXPECT_LT(again, milliseconds(1500)) << "two clocks need a second each until they follow";
}

TEST(AravisPtp, AClockThatDoesNotFollowIsNamedByTheDeadline) {
  for (const auto& [kind, status] : {std::pair("never", "Listening"), std::pair("wide", "2000 us beside it")}) {
    RealClock clock;
    const auto begun = clock.now();
    const auto error = refused_with({std::string("ptp=") + kind}, by_ptp, seconds(2));
    EXPECT_EQ(error.code, ErrorCode::timeout) << error.message;
    EXPECT_THAT(error.message, HasSubstr("left camera 40012345: its clock does not follow PTP in time"));
    EXPECT_THAT(error.message, HasSubstr(status));
    EXPECT_LT(clock.now() - begun, seconds(4));
  }
}

}  // namespace
}  // namespace scanrig
