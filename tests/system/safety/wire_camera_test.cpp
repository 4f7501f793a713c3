#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>

#include "pipeline/storage/scan_folder.h"
#include "tests/component/safety/wire_rig.h"
#include "tests/system/daemon/process.h"
#include "tests/system/safety/truth_server.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

const WireRig::Changes kSimulatedCamera{
    {"driver = \"v4l2-side-by-side\"\nboth = { device = \"no-camera\" }\nexternal_trigger = true\n"
     "pixel_format = \"RGGB\"\nsize = { width = 640, height = 240 }\n",
     "driver = \"simulated\"\ntruth = \"control.sock\"\n"},
    {"frame_timeout_ms = 500\n", ""},
    {"views = 8", "views = 6"},
    {"speed_deg_s = 45", "speed_deg_s = 180"},
    {"acceleration_deg_s2 = 90", "acceleration_deg_s2 = 720"}};

constexpr std::chrono::minutes kScanLimit(2);  // of a pose, which takes 18 s

/// scanrigd-sim over wires: every driver but the camera's is the shipped one.
class CameraOnWires : public testing::Test {
 protected:
  WireRig rig{{.gear_ratio = 18}, kSimulatedCamera};
  TruthServer truth{rig.folder / "control.sock", [this] {
                      const auto t = rig.drive.truth();
                      return nlohmann::json{{"angle_deg", t.table_deg},
                                            {"speed_deg_s", t.speed_deg_s},
                                            {"stopped", !t.moving},
                                            {"projector_on", rig.lamp("DOTS")}}
                          .dump();
                    }};
  std::optional<Process> daemon;
};

TEST_F(CameraOnWires, AScanShowsTheObjectAtTheTrueAngleAndInTheLightThereWas) {
  daemon.emplace(std::vector<std::string>{SCANRIGD_SIM_PROGRAM, "--config", rig.config(), "--scale", "0.25"},
                 rig.folder / "daemon.log");
  ASSERT_TRUE(rig.wait_halted()) << *read_file(rig.folder / "daemon.log");
  rig.press("RESET");
  ASSERT_TRUE(rig.wait_ready());
  rig.press("START");
  ASSERT_TRUE(rig.wait_for([&] { return rig.lamp("FLIP"); }, kScanLimit)) << *read_file(rig.folder / "daemon.log");
  EXPECT_EQ(truth.last_question(), "{\"get\":\"truth\"}\n");

  const auto job = rig.only_job();
  const auto scan = ScanFolder::open(job);
  ASSERT_TRUE(scan) << scan.error().message;
  const auto& views = scan->manifest().poses.at(0).views;
  ASSERT_EQ(views.size(), 6u);
  for (std::size_t v = 0; v < views.size(); ++v) {
    EXPECT_NEAR(views[v].measured_deg, views[v].commanded_deg, 0.02);
    EXPECT_GT(views[v].settling_ms, 100);
    const auto images = scan->load_images(0, v);
    ASSERT_TRUE(images) << images.error().message;
    EXPECT_GT(cv::norm(images->left_pattern, images->left_plain, cv::NORM_L1) / 320 / 240, 3) << "dots and none";
  }
  EXPECT_GT(cv::norm(scan->load_images(0, 0)->left_plain, scan->load_images(0, 1)->left_plain, cv::NORM_INF), 20)
      << "another side of the object";

  rig.press("START");
  EXPECT_TRUE(rig.wait_for([&] { return std::filesystem::exists(job / "truth.json"); }, kScanLimit));
  EXPECT_EQ(ScanFolder::open(job)->manifest().state, "scanned");
}

TEST_F(CameraOnWires, TheShippedDaemonKnowsNoSimulatedCamera) {
  EXPECT_EQ(Process({SCANRIGD_PROGRAM, "--config", rig.config()}, rig.folder / "output").wait(), 3);
  EXPECT_THAT(*read_file(rig.folder / "output"),
              HasSubstr("\"simulated\" is not one of aravis, v4l2, v4l2-side-by-side"));
}

}  // namespace
}  // namespace scanrig
