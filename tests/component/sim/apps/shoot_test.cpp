#include "sim/apps/shoot.h"

#include <gtest/gtest.h>

#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "tests/own_folder.h"
#include "tests/slowness.h"

namespace scanrig::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class Shoot : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = own_folder();
    fs::remove_all(folder_);
    options_.scene.image_scale = 0.1;
    options_.views = 2;
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result<void> with(int threads, const fs::path& folder) const {
    Result<void> done;
    with_threads(threads, [&] { done = shoot(options_, folder); });
    return done;
  }
  static json parse(const fs::path& file) { return json::parse(read_file(file).value()); }

  fs::path folder_;
  ShootOptions options_;
};

TEST_F(Shoot, WritesAWholeScanFolder) {
  ASSERT_TRUE(shoot(options_, folder_));
  const json scan = parse(folder_ / "scan.json");
  EXPECT_EQ(scan["format"], "scanrig-scan");
  EXPECT_EQ(scan["state"], "scanned");
  EXPECT_EQ(scan["profile"], profile_sha256());
  EXPECT_EQ(scan["calibration"]["sha256"], sha256(read_file(folder_ / "calibration.json").value()));
  ASSERT_EQ(scan["poses"].size(), 2U);
  for (const auto& pose : scan["poses"]) {
    ASSERT_EQ(pose["views"].size(), 2U);
    for (const auto& view : pose["views"]) {
      ASSERT_EQ(view["files"].size(), 4U);
      for (const auto& file : view["files"]) {
        const auto bytes = read_file(folder_ / file["path"].get<std::string>());
        ASSERT_TRUE(bytes);
        EXPECT_EQ(sha256(*bytes), file["sha256"].get<std::string>());
      }
      const cv::Mat image = cv::imread((folder_ / view["files"]["left_plain"]["path"]).string(), cv::IMREAD_UNCHANGED);
      EXPECT_EQ(image.size(), cv::Size(128, 96));
      EXPECT_EQ(image.type(), CV_8UC1);
    }
  }
  const json calibration = parse(folder_ / "calibration.json"), truth = parse(folder_ / "truth.json");
  EXPECT_EQ(calibration["left"], truth["left"]);
  EXPECT_EQ(calibration["left"]["width"], 128);
  for (int pose = 0; pose < 2; ++pose) {
    for (int view = 0; view < 2; ++view) {
      EXPECT_NEAR(truth["poses"][pose]["angles_deg"][view], scan["poses"][pose]["views"][view]["measured_deg"], 0.0021);
    }
  }
}

TEST_F(Shoot, OfTheWorkshopNamesItsProfileAndItsSizes) {
  options_.scene.profile = {.effects = choose_effects("workshop", "wobble", "").value(), .material = "gloss"};
  options_.scene.poses = options_.views = 1;
  const fs::path solved = folder_.string() + "_solved.json";
  std::ofstream(solved) << "solved elsewhere";
  options_.calibration = solved;
  ASSERT_TRUE(shoot(options_, folder_));
  const json scan = parse(folder_ / "scan.json"), rig = parse(folder_ / "rig_truth.json");
  EXPECT_EQ(scan["profile"], options_.scene.profile.sha256());
  EXPECT_EQ(parse(folder_ / "truth.json")["profile_sha256"], scan["profile"]);
  EXPECT_EQ(rig["material"], "gloss");
  EXPECT_EQ(rig["effects"]["wobble_deg"], 0.0);
  EXPECT_EQ(rig["effects"]["runout_mm"], 0.010);
  EXPECT_EQ(rig["table"]["axis"]["worm_deg"], 0.01);
  EXPECT_EQ(read_file(folder_ / "calibration.json").value(), "solved elsewhere");
  fs::remove(solved);
  options_.calibration = folder_ / "gone.json";
  EXPECT_EQ(shoot(options_, folder_.string() + "_other").error().code, ErrorCode::not_found);
}

TEST_F(Shoot, GivesTheSameBytesForTheSameSeed) {
  const fs::path other = folder_.string() + "_again";
  options_.scene.poses = 1;
  options_.views = 1;
  ASSERT_TRUE(with(1, folder_));
  ASSERT_TRUE(with(3, other));
  for (const char* file : {"scan.json", "truth.json", "truth.ply", "pose1/view00/left_pattern.png"}) {
    EXPECT_EQ(read_file(folder_ / file).value(), read_file(other / file).value()) << file;
  }
  fs::remove_all(other);
}

TEST_F(Shoot, DoesNotOverwriteAScan) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "scan.json") << "{}";
  EXPECT_EQ(shoot(options_, folder_).error().code, ErrorCode::exists);
}

TEST_F(Shoot, RefusesAnImpossibleNumberOfViews) {
  options_.views = 0;
  EXPECT_EQ(shoot(options_, folder_).error().code, ErrorCode::out_of_range);
}

TEST_F(Shoot, NamesTheFolderThatCannotBeMade) {
  std::ofstream(folder_) << "a file in the way";
  const auto done = shoot(options_, folder_);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::io);
}

/// Processor time of one view, pattern and plain, of the second look.
double seconds_of_view(const SceneOptions& options) {
  double seconds = 0.0;
  with_threads(2, [&] {
    auto scene = Scene::create(options).value();
    (void)scene->shoot(0, 0.0, true, 1);  // the light of the pose is gathered once
    const std::clock_t begin = std::clock();
    (void)scene->shoot(0, 1.0, true, 2);
    (void)scene->shoot(0, 1.0, false, 3);
    seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  });
  return seconds;
}

// The promises, 4 s on two idle cores and 6 s for the workshop, are tested by the bench. Other programs run here, and
// machines differ by a factor of two: the plain profile may not take 2.5 times its promise, and the workshop, whose
// measure is the plain profile on the same machine in the same minute, not over 1.5 times what the promises allow it.
TEST(View, RendersInTimeOnTwoCores) {
  const double seconds = seconds_of_view({});
  testing::Test::RecordProperty("processor_seconds", std::to_string(seconds));
  EXPECT_LT(seconds, 2.5 * 2 * 4.0 * kSlowness);

  SceneOptions options;
  options.profile.effects = choose_effects("workshop", "", "").value();
  const double of_workshop = seconds_of_view(options);
  testing::Test::RecordProperty("processor_seconds_of_the_workshop", std::to_string(of_workshop));
  EXPECT_LT(of_workshop / seconds, 1.5 * 6.0 / 4.0);
}

}  // namespace
}  // namespace scanrig::sim
