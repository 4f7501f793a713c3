#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files.h"
#include "daemon/ctl/doctor/examine_rig.h"
#include "drivers/camera/image_quality.h"
#include "tests/own_folder.h"

namespace scanrig::ctl::doctor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// One side's image: plain light of `grey`, and independent grains of `contrast` grey values behind a lens.
cv::Mat image(double grey, double contrast, int seed, double blur_px = 1.2) {
  cv::Mat grains(240, 320, CV_32F);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(grains, cv::RNG::NORMAL, 0.0, 1.0);
  cv::GaussianBlur(grains, grains, {}, blur_px);
  grains *= contrast * 3.5 * blur_px;  // about what the blur takes
  cv::Mat bytes;
  grains.convertTo(bytes, CV_8U, 1.0, grey);
  return bytes;
}

StereoFrame frame(cv::Mat left, cv::Mat right) {
  StereoFrame pair;
  pair.left = std::move(left);
  pair.right = std::move(right);
  pair.left_evidence = measure(pair.left, pair.format);
  pair.right_evidence = measure(pair.right, pair.format);
  pair.left_right_correlation = left_right_correlation(pair.left, pair.right, pair.format);
  return pair;
}

/// A dark room, pattern light of 24 and plain light of 90 grey values.
class DoctorLight : public testing::Test {
 protected:
  DoctorLight() {
    images_.off = frame(image(1, 0.4, 1), image(1, 0.4, 2));
    for (int i = 0; i < 12; ++i) {
      images_.keep(Light::pattern, frame(image(24, 10, 3), image(24, 10, 4)));
      images_.keep(Light::plain, frame(image(90, 2, 5), image(90, 2, 6)));
    }
  }
  /// Ids of the findings.
  std::vector<std::string> found() {
    Report report;
    report.section("Light");
    may_match_ = judge_images(images_, report);
    std::vector<std::string> ids;
    for (const Finding& finding : report.findings()) {
      ids.push_back(finding.id);
      EXPECT_FALSE(finding.problem.empty() || finding.remedy.empty()) << finding.id;
    }
    return ids;
  }
  void set(Light light, StereoFrame pair) {
    (light == Light::plain ? images_.plain : images_.pattern) = std::move(pair);
  }

  TrialImages images_;
  bool may_match_ = false;
};

TEST_F(DoctorLight, OfASoundRigHasNoFinding) {
  EXPECT_THAT(found(), IsEmpty());
  EXPECT_TRUE(may_match_);
}

TEST_F(DoctorLight, ThatIsOnWhileItIsOffIsFound) {
  images_.off = images_.plain;
  EXPECT_THAT(found(), ElementsAre("light_stays_on"));
  EXPECT_FALSE(may_match_);
}

TEST_F(DoctorLight, OfTheRoomIsFoundAndTheRestStillJudged) {
  images_.off = frame(image(20, 0.4, 1), image(20, 0.4, 2));
  set(Light::pattern, frame(image(44, 10, 3), image(44, 10, 4)));
  EXPECT_THAT(found(), ElementsAre("room_light"));
  EXPECT_TRUE(may_match_);
}

TEST_F(DoctorLight, ThatNoCameraSeesIsFoundOnce) {
  set(Light::pattern, images_.off);
  set(Light::plain, images_.off);
  EXPECT_THAT(found(), ElementsAre("no_light"));
}

TEST_F(DoctorLight, ThatOneCameraDoesNotSeeIsFoundByItsName) {
  set(Light::pattern, frame(image(24, 10, 3), image(1, 0.4, 4)));
  set(Light::plain, frame(image(90, 2, 5), image(1, 0.4, 6)));
  EXPECT_THAT(found(), ElementsAre("dark_camera"));
  set(Light::plain, frame(image(90, 2, 5), image(90, 2, 6)));
  EXPECT_THAT(found(), ElementsAre("dark_camera")) << "the pattern reaches only the left one";
}

TEST_F(DoctorLight, OfOneLampThatIsMissingIsFound) {
  const TrialImages sound = images_;
  set(Light::pattern, images_.off);
  EXPECT_THAT(found(), ElementsAre("no_pattern"));
  images_ = sound;
  set(Light::plain, images_.off);
  EXPECT_THAT(found(), ElementsAre("no_plain_light"));
}

TEST_F(DoctorLight, WithoutAPatternOrInTheWrongOrderIsFound) {
  const TrialImages sound = images_;
  set(Light::pattern, frame(image(90, 2, 3), image(90, 2, 4)));
  EXPECT_THAT(found(), ElementsAre("no_pattern"));
  EXPECT_FALSE(may_match_);
  images_.pattern = sound.plain;
  images_.plain = sound.pattern;
  EXPECT_THAT(found(), ElementsAre("lights_exchanged"));
}

TEST_F(DoctorLight, ThatIsTooBrightIsFound) {
  set(Light::plain, frame(image(250, 10, 5), image(90, 2, 6)));
  EXPECT_THAT(found(), ElementsAre("overexposed"));
}

TEST_F(DoctorLight, ThatChangesIsFound) {
  auto& [left, right] = images_.brightness[1];
  for (std::size_t i = 0; i < left.size(); ++i) left[i] *= 1.0 + 0.01 * static_cast<double>(i);
  EXPECT_THAT(found(), ElementsAre("light_unstable"));
}

TEST_F(DoctorLight, ALensOutOfFocusIsFound) {
  set(Light::pattern, frame(image(24, 10, 3), image(24, 6, 4, 2.4)));
  EXPECT_THAT(found(), ElementsAre("focus_difference"));
}

TEST_F(DoctorLight, OneImageOnBothSidesIsFound) {
  set(Light::pattern, frame(images_.pattern.left, images_.pattern.left));
  EXPECT_THAT(found(), ElementsAre("same_image"));
  EXPECT_FALSE(may_match_);
}

TEST_F(DoctorLight, ThatAPersonSwitchesIsJudgedByThePatternAlone) {
  images_.off = images_.plain = {};
  EXPECT_THAT(found(), IsEmpty());
}

/// The job folder, and the space and speed of its disk.
class DoctorMachine : public testing::Test {
 protected:
  DoctorMachine() {
    rig_.storage.root = folder_ / "jobs" / "deep";
    rig_.storage.reserve_gib = 0.001;
  }
  ~DoctorMachine() override { std::filesystem::remove_all(folder_); }
  std::vector<std::string> found() {
    Report report;
    examine_machine({rig_, file_, {}}, clock_, report);
    std::vector<std::string> ids;
    for (const Finding& finding : report.findings()) ids.push_back(finding.id);
    return ids;
  }
  const std::filesystem::path folder_ = own_folder("doctor_"), file_ = folder_ / "rig.toml";
  RealClock clock_;
  config::RigConfig rig_;
};

TEST_F(DoctorMachine, AFolderThatIsStillToBeMadeIsNoFindingAndNothingIsLeft) {
  ASSERT_TRUE(create_directories_synced(folder_));
  EXPECT_THAT(found(), testing::AnyOf(IsEmpty(), ElementsAre("slow_disk")));
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(DoctorMachine, AFileInItsPlaceIsFound) {
  ASSERT_TRUE(create_directories_synced(folder_));
  ASSERT_TRUE(write_file_atomically(folder_ / "jobs", std::string_view("a file")));
  EXPECT_THAT(found(), ElementsAre("folder_not_writable"));
}

TEST_F(DoctorMachine, LessSpaceThanTheReserveIsFound) {
  ASSERT_TRUE(create_directories_synced(folder_));
  rig_.storage.reserve_gib = 1e9;
  EXPECT_THAT(found(), ElementsAre("disk_full"));
}

TEST(DoctorReport, HasTheMissingUdevRuleOfANumberedPortAndNoneOfANameBySerialNumber) {
  const auto printed = [](const char* device) {
    Report report;
    print_missing_snippets(device, "/etc/scanrig/rig.toml", report);
    return report.text();
  };
  EXPECT_THAT(printed("/dev/ttyUSB0"), HasSubstr("SYMLINK+=\"scanrig/turntable\""));
  EXPECT_THAT(printed("/dev/serial/by-id/usb-FTDI_1234"), Not(HasSubstr("SYMLINK")));
}

TEST(DoctorReport, AsJsonHasEachFindingWithItsRemedy) {
  Report report;
  report.section("Disk");
  report.note("ok");
  report.find("slow_disk", "It is slow.", "Use an SSD.");
  const auto json = nlohmann::json::parse(report.json());
  EXPECT_EQ(json["findings"][0]["id"], "slow_disk");
  EXPECT_EQ(json["findings"][0]["problem"], "It is slow.");
  EXPECT_EQ(json["findings"][0]["remedy"], "Use an SSD.");
  EXPECT_EQ(json["sections"][0]["lines"][0], "ok");
}

}  // namespace
}  // namespace scanrig::ctl::doctor
