#include <gmock/gmock.h>

#include <bit>
#include <opencv2/core.hpp>

#include "sim/wire/gige_develop.h"
#include "tests/unit/sim/devices/manual_clock.h"

namespace scanrig::sim::wire {
namespace {

class GigeRegistersTest : public testing::Test {
 protected:
  GigeRegisters made(const GigeModel& model = {}) { return {model, clock_}; }
  /// Writes as a host does: by the feature's address.
  static GvcpStatus write(GigeRegisters& registers, std::string_view name, double value, std::uint32_t selected = 0) {
    const auto& features = registers.features();
    const auto feature = std::ranges::find(features, name, &GigeFeature::name);
    if (feature == features.end()) return GvcpStatus::invalid_address;
    const bool real = feature->kind == GigeFeature::Kind::real;
    const auto word = real ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                           : static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
    return registers.write(feature->address + 4 * selected, word).status;
  }
  static GvcpStatus choose(GigeRegisters& registers, std::string_view name, std::string_view entry) {
    const auto feature = std::ranges::find(registers.features(), name, &GigeFeature::name);
    for (const auto& [known, value] : feature->entries) {
      if (known == entry) return write(registers, name, value);
    }
    return GvcpStatus::invalid_parameter;
  }
  static std::vector<std::uint8_t> develop(const GigeRegisters& registers, const cv::Mat& image) {
    return develop_gige(image, registers, 10'000, 0);
  }
  static double mean(const std::vector<std::uint8_t>& bytes) { return cv::mean(bytes)[0]; }

  ManualClock clock_;
  const cv::Mat grey_ = cv::Mat(120, 160, CV_8U, cv::Scalar(100));
};

TEST_F(GigeRegistersTest, WhatFormsAStreamIsLockedWhileItAcquires) {
  auto registers = made();
  ASSERT_EQ(write(registers, "AcquisitionStart", 1), GvcpStatus::success);
  for (const char* name : {"Width", "Height", "OffsetX", "PixelFormat", "BinningHorizontal", "ReverseX",
                           "TriggerSource", "TriggerMode", "ChunkModeActive", "AcquisitionMode"}) {
    EXPECT_EQ(write(registers, name, registers.number(name)), GvcpStatus::access_denied) << name;
  }
  EXPECT_EQ(write(registers, "UserSetLoad", 1), GvcpStatus::access_denied);
  EXPECT_EQ(write(registers, "ExposureTime", 500), GvcpStatus::success);
  ASSERT_EQ(write(registers, "AcquisitionStop", 1), GvcpStatus::success);
  EXPECT_EQ(choose(registers, "TriggerSource", "Line0"), GvcpStatus::success);
}

TEST_F(GigeRegistersTest, AnAutomaticKeepsItsValueFromTheHost) {
  auto registers = made();
  for (const auto& [automatic, value] : {std::pair("ExposureAuto", "ExposureTime"), std::pair("GainAuto", "Gain"),
                                         std::pair("BalanceWhiteAuto", "BalanceRatio")}) {
    ASSERT_EQ(choose(registers, automatic, "Continuous"), GvcpStatus::success);
    EXPECT_EQ(write(registers, value, 20), GvcpStatus::access_denied) << value;
  }
  const double before = registers.number("ExposureTime");
  adjust_gige(registers, 30);
  EXPECT_GT(registers.number("ExposureTime"), before);
}

TEST_F(GigeRegistersTest, BinningShrinksTheRegionAndLeavesItSmall) {
  auto registers = made();
  ASSERT_EQ(write(registers, "BinningHorizontal", 2), GvcpStatus::success);
  EXPECT_EQ(registers.frame_size(), cv::Size(80, 120));
  EXPECT_EQ(develop(registers, grey_).size(), 80u * 120u);
  ASSERT_EQ(write(registers, "BinningHorizontal", 1), GvcpStatus::success);
  EXPECT_EQ(registers.frame_size(), cv::Size(80, 120));
  EXPECT_EQ(write(registers, "OffsetX", 40), GvcpStatus::success);
  EXPECT_EQ(write(registers, "Width", 160), GvcpStatus::invalid_parameter) << "too wide beside the offset";
}

TEST_F(GigeRegistersTest, ValuesOutOfRangeAndOtherAddressesAreRefused) {
  auto registers = made();
  EXPECT_EQ(write(registers, "ExposureTime", 1), GvcpStatus::invalid_parameter);
  EXPECT_EQ(write(registers, "PixelFormat", 7), GvcpStatus::invalid_parameter);
  EXPECT_EQ(write(registers, "WidthMax", 160), GvcpStatus::write_protect);
  EXPECT_EQ(registers.write(0x90000000, 1).status, GvcpStatus::invalid_address);
  EXPECT_FALSE(registers.read(kGigeFirstAddress + 2));
}

TEST_F(GigeRegistersTest, EachSettingShowsInTheImage) {
  struct Effect {
    const char* feature;
    double value, mean;
  };
  // Of a grey of 100 at 10 ms and 0 dB; the ramp's mean is that of 0 to 159.
  for (const Effect& effect : {Effect{"ExposureTime", 5000, 50}, Effect{"Gain", 6, 200}, Effect{"BlackLevel", 10, 110},
                               Effect{"LUTEnable", 1, 155}, Effect{"TestPattern", 1, 79.5},
                               Effect{"ExposureMode", 1, 0}, Effect{"ReverseX", 1, 100}}) {
    auto registers = made();
    ASSERT_EQ(write(registers, effect.feature, effect.value), GvcpStatus::success) << effect.feature;
    EXPECT_NEAR(mean(develop(registers, grey_)), effect.mean, 0.6) << effect.feature;
  }
  auto registers = made();
  ASSERT_EQ(write(registers, "Gamma", 0.5), GvcpStatus::success);
  EXPECT_NEAR(mean(develop(registers, grey_)), 100, 0.5) << "not switched on";
  ASSERT_EQ(write(registers, "GammaEnable", 1), GvcpStatus::success);
  EXPECT_NEAR(mean(develop(registers, grey_)), 160, 0.5);
}

TEST_F(GigeRegistersTest, WhiteBalanceActsOnItsOwnColour) {
  auto registers = made();
  ASSERT_EQ(choose(registers, "PixelFormat", "BayerRG8"), GvcpStatus::success);
  ASSERT_EQ(write(registers, "BalanceRatio", 2, 0), GvcpStatus::success);
  const auto bytes = develop(registers, grey_);
  EXPECT_EQ(bytes[0], 200);  // red
  EXPECT_EQ(bytes[1], 100);  // green
  EXPECT_EQ(bytes[160 + 1], 100) << "blue";
}

TEST_F(GigeRegistersTest, ChunksAndWiderPixelsChangeThePayload) {
  auto registers = made();
  const std::size_t plain = develop(registers, grey_).size();
  ASSERT_EQ(write(registers, "ChunkModeActive", 1), GvcpStatus::success);
  EXPECT_GT(develop(registers, grey_).size(), plain);
  EXPECT_EQ(develop(registers, grey_).size(), registers.payload_bytes());
  ASSERT_EQ(write(registers, "ChunkModeActive", 0), GvcpStatus::success);
  ASSERT_EQ(choose(registers, "PixelFormat", "Mono12"), GvcpStatus::success);
  const auto words = develop(registers, grey_);
  ASSERT_EQ(words.size(), 2 * plain);
  EXPECT_EQ(words[0] + 256 * words[1], 1600) << "of 4095";
}

TEST_F(GigeRegistersTest, AnUnknownStateIsAnotherForEachSeedAndUserSetDefaultEndsIt) {
  GigeModel model;
  int different = 0, acquiring = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    model.state = seed;
    auto registers = made(model);
    acquiring += registers.is_acquiring();
    different += registers.number("ExposureTime") != 10000 && registers.payload_bytes() != 160u * 120u;
    ASSERT_EQ(write(registers, "AcquisitionStop", 1), GvcpStatus::success);
    ASSERT_EQ(choose(registers, "UserSetSelector", "Default"), GvcpStatus::success);
    ASSERT_EQ(write(registers, "UserSetLoad", 1), GvcpStatus::success);
    EXPECT_EQ(develop(registers, grey_), develop(made(), grey_)) << seed;
  }
  EXPECT_GT(different, 25);
  EXPECT_GT(acquiring, 10);
  EXPECT_LT(acquiring, 30);
}

TEST_F(GigeRegistersTest, PtpFollowsItsClockAfterAWhile) {
  GigeModel model;
  model.ptp = GigeModel::Ptp::slave;
  auto registers = made(model);
  EXPECT_EQ(registers.entry("PtpStatus"), "Disabled");
  ASSERT_EQ(write(registers, "PtpEnable", 1), GvcpStatus::success);
  EXPECT_EQ(registers.entry("PtpStatus"), "Listening");
  clock_.sleep_for(std::chrono::milliseconds(500));
  EXPECT_EQ(registers.entry("PtpStatus"), "Uncalibrated");
  clock_.sleep_for(std::chrono::seconds(1));
  EXPECT_EQ(registers.entry("PtpStatus"), "Slave");
  EXPECT_TRUE(registers.is_synchronised());
}

TEST(GigeModelTest, WordsThatAreNoPropertyAreRefused) {
  GigeModel model;
  for (const char* word : {"state=", "state=x", "ptp=maybe", "user-sets=2", "stuck=", "colour=red", ""}) {
    EXPECT_FALSE(change_gige_model(model, word)) << word;
  }
  EXPECT_TRUE(change_gige_model(model, "state=7"));
  EXPECT_EQ(model.state, 7u);
}

}  // namespace
}  // namespace scanrig::sim::wire
