#include "drivers/projector/lightcrafter_flash.h"

#include <gmock/gmock.h>

#include "tests/component/lightcrafter/lightcrafter_bench.h"

namespace scanrig {
namespace {

using dlpc350::Version;
using sim::wire::LightCrafterFlash;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr std::uint32_t kNew = 0x04020003;  // 4.2.3
constexpr std::size_t kSector = LightCrafterFlash::kSectorBytes;

class LightCrafterFirmware : public testing::Test {
 protected:
  Result<Version> load(const std::vector<std::uint8_t>& file) {
    return dlpc350::load_firmware(
        file, bench_.transport(),
        [this](std::string_view step, double share) {
          if (on_progress_) on_progress_(step, share);
        },
        bench_.clock(), ample());
  }
  Deadline ample() { return Deadline::after(bench_.clock(), seconds(60)); }
  /// A connection from before a restart is noticed first.
  Result<void> fire() {
    std::ignore = bench_.projector().turn_off(ample());
    return bench_.projector().fire(Light::pattern, ample());
  }
  void expect_content(const std::vector<std::uint8_t>& file) {
    const auto& flash = bench_.device().flash().bytes();
    EXPECT_TRUE(std::equal(file.begin() + kSector, file.end(), flash.begin() + kSector));
  }

  LightCrafterBench bench_;
  std::vector<std::uint8_t> file_ = LightCrafterFlash::make_file(kNew, 4 * kSector + 1000);
  std::function<void(std::string_view, double)> on_progress_;
};

TEST_F(LightCrafterFirmware, IsWrittenBesideTheBootloaderAndStarts) {
  const auto before = bench_.device().flash().bytes();
  std::vector<std::string> steps;
  double last = 0;
  on_progress_ = [&](std::string_view step, double share) {
    if (steps.empty() || steps.back() != step) {
      EXPECT_TRUE(steps.empty() || last == 1.0);
      steps.emplace_back(step);
      last = 0;
    }
    EXPECT_GE(share, last);
    last = share;
  };
  const auto loaded = load(file_);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(*loaded, (Version{4, 2, 3}));
  EXPECT_THAT(steps, testing::ElementsAre("erase", "write", "check"));
  expect_content(file_);
  const auto& flash = bench_.device().flash().bytes();
  EXPECT_TRUE(std::equal(before.begin(), before.begin() + kSector, flash.begin()));
  ASSERT_TRUE(bench_.projector().fire(Light::pattern, ample()));
  EXPECT_EQ(bench_.projector().description(), "LightCrafter 4500, firmware 4.2.3");
}

TEST_F(LightCrafterFirmware, AnInterruptedLoadIsNamedAndTheNextOneSucceeds) {
  for (const char* at : {"erase", "write", "check"}) {
    on_progress_ = [&](std::string_view step, double share) {
      if (step != at || share < 0.5) return;
      bench_.device().power_cycle();
      on_progress_ = {};
    };
    const auto cut = load(file_);
    ASSERT_FALSE(cut) << at;
    EXPECT_EQ(cut.error().code, ErrorCode::io);
    EXPECT_THAT(cut.error().message, HasSubstr("the flash is not whole, run scanrig projector load again"));
    if (at != std::string_view("check")) {
      const auto fired = fire();
      ASSERT_FALSE(fired);
      EXPECT_EQ(fired.error().code, ErrorCode::unsupported);
      EXPECT_THAT(fired.error().message, HasSubstr("no whole firmware; write it with scanrig projector load"));
    }
    const auto again = load(file_);
    ASSERT_TRUE(again) << again.error().message;
    expect_content(file_);
    EXPECT_TRUE(fire());
  }
}

TEST_F(LightCrafterFirmware, ADamagedByteIsFoundInItsSector) {
  on_progress_ = [&](std::string_view step, double share) {
    if (step != "write" || share < 0.6) return;
    bench_.device().flash().damage_next_data();
    on_progress_ = {};
  };
  const auto loaded = load(file_);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::protocol);
  EXPECT_THAT(loaded.error().message, HasSubstr("differs from the file in the sector at 0x040000"));
  EXPECT_TRUE(load(file_));
}

TEST_F(LightCrafterFirmware, FilesThatAreNoneAreRefusedBeforeAnythingIsErased) {
  const auto before = bench_.device().flash().bytes();
  auto unsigned_file = file_;
  unsigned_file[kSector] ^= 1;
  auto without_version = file_;
  without_version[kSector + 115] = 0;
  const std::vector<std::uint8_t> longest(31 * 1024 * 1024);
  for (const auto& [file, why] :
       {std::pair(std::vector<std::uint8_t>(1000), "too short"), std::pair(longest, "too long"),
        std::pair(unsigned_file, "no flash table"), std::pair(without_version, "ends before its version")}) {
    const auto loaded = load(file);
    ASSERT_FALSE(loaded) << why;
    EXPECT_EQ(loaded.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(loaded.error().message, HasSubstr(why));
  }
  const auto old = load(LightCrafterFlash::make_file(0x02000000, 3 * kSector));
  ASSERT_FALSE(old);
  EXPECT_EQ(old.error().code, ErrorCode::unsupported);
  EXPECT_EQ(bench_.device().flash().bytes(), before);
}

TEST_F(LightCrafterFirmware, AnotherFlashThanTheModulesIsLeftAlone) {
  const auto before = bench_.device().flash().bytes();
  bench_.device().flash().set_maker(0x00EF);
  const auto loaded = load(file_);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::unsupported);
  EXPECT_THAT(loaded.error().message, HasSubstr("its flash is 00EF:227E"));
  EXPECT_EQ(bench_.device().flash().bytes(), before);
}

TEST_F(LightCrafterFirmware, WithoutADeviceNothingIsFound) {
  bench_.plug(false);
  const auto loaded = load(file_);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::not_found);
}

TEST_F(LightCrafterFirmware, TooOldOneIsRefusedByTheProjector) {
  bench_.device().flash().install(LightCrafterFlash::make_file(0x02000001, 3 * kSector));
  const auto fired = bench_.projector().fire(Light::pattern, ample());
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::unsupported);
  EXPECT_THAT(fired.error().message, HasSubstr("firmware 2.0.1 is older than 3.0.0"));
}

}  // namespace
}  // namespace scanrig
