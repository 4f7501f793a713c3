#include <gmock/gmock.h>

#include "pipeline/scan/scan_folder.h"
#include "sim/wire/gige_camera.h"
#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

using sim::wire::hidden_number;
using testing::AllOf;
using testing::HasSubstr;

/// The shipped daemon with every one of its drivers, cameras too.
class CamerasOnWires : public RigOnWires {
 protected:
  void start() {
    start_rig({"--cameras", "gige", "--scale", "0.25"});
    start_daemon({SCANRIGD_PROGRAM});
    ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  }
  void begin_scan() {
    ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  }
  void spoil(const char* fault, int count) {
    ASSERT_EQ(say({{"set", {{"camera_fault", fault}, {"camera", "right"}, {"fault_count", count}}}})["ok"], true);
  }
  void plug_right(bool in) { ASSERT_EQ(say({{"set", {{"camera_unplugged", !in}, {"camera", "right"}}}})["ok"], true); }
  /// Of the newest job.
  json job() { return ask("jobs/" + jobs().back()["id"].get<std::string>()); }
  bool wait_stored(std::size_t views) {
    return soon([&] { return !jobs().empty() && job()["stored"].size() >= views; });
  }
  /// What is wrong with the cameras; empty: nothing.
  std::string camera_problem() {
    for (const auto& device : ask("status")["devices"]) {
      if (device["name"] == "camera" && !device["ok"]) return device["problem"]["message"];
    }
    return "";
  }
  bool preview_comes() {
    return soon([&] {
      const auto jpeg = ctl::fetch(folder_ / "api.sock", "/api/v1/preview/right");
      return jpeg && jpeg->starts_with("\xFF\xD8\xFF");
    });
  }
};

TEST_F(CamerasOnWires, AScanRedoesALostExposureUsesTheFramesOfOneEdgeOnlyAndEndsInTheModel) {
  start_rig({"--cameras", "gige", "--scale", "0.25", "--number-frames"});
  start_daemon({SCANRIGD_PROGRAM});
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_EQ(say({{"set", {{"camera_fault", "lost"}, {"camera", "right"}}}})["ok"], true);
  ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  ASSERT_TRUE(soon([&] { return lamp("flip_request"); })) << log();
  ASSERT_EQ(say({{"turn_over", true}})["ok"], true);
  ASSERT_TRUE(press_until("start", [&] { return !lamp("flip_request"); })) << log();
  ASSERT_TRUE(soon([&] { return !jobs().empty() && jobs()[0]["state"] == "done"; })) << log() << jobs();

  const auto job = ask("jobs/" + jobs()[0]["id"].get<std::string>());
  const auto scan = ScanFolder::open(job["folder"].get<std::string>());
  ASSERT_TRUE(scan) << scan.error().message;
  std::uint32_t edge = 1;  // the first one's right frame was lost
  std::size_t stored = 0;
  for (std::size_t pose = 0; pose < 2; ++pose) {
    for (std::size_t view = 0; view < 4; ++view, ++stored) {
      EXPECT_EQ(job["stored"][stored]["redone"], stored == 0 ? 1 : 0);
      const auto images = scan->load_images(pose, view);
      ASSERT_TRUE(images) << images.error().message;
      ++edge;
      EXPECT_EQ(hidden_number(images->left_pattern), edge);
      EXPECT_EQ(hidden_number(images->right_pattern), edge);
      ++edge;
      EXPECT_EQ(hidden_number(images->left_plain), edge);
      EXPECT_EQ(hidden_number(images->right_plain), edge);
    }
  }
  EXPECT_TRUE(std::filesystem::exists(job["model"].get<std::string>()));
}

TEST_F(CamerasOnWires, PicturesThatAreDarkBlurredOrOfTheOtherSideAreRedone) {
  start();
  spoil("dark", 2);
  begin_scan();
  ASSERT_TRUE(wait_stored(1)) << log();
  EXPECT_EQ(job()["stored"][0]["redone"], 2);
  spoil("swapped", 2);
  ASSERT_TRUE(wait_stored(3)) << log();
  spoil("blurred", 2);
  ASSERT_TRUE(soon([&] { return lamp("flip_request"); })) << log();
  int redone = 0;
  for (const auto& view : job()["stored"]) redone += view["redone"].get<int>();
  EXPECT_GE(redone, 4) << "of two spoilt exposures at least one was with dots";
}

TEST_F(CamerasOnWires, ACameraThatStaysDarkEndsTheJobInItsName) {
  start();
  spoil("dark", 100);
  begin_scan();
  ASSERT_TRUE(soon([&] { return !jobs().empty() && jobs().back()["state"] == "interrupted"; })) << log();
  EXPECT_THAT(job()["error"]["message"].get<std::string>(), HasSubstr("right camera: the picture in the dots is dark"));
}

TEST_F(CamerasOnWires, ACameraPulledInAScanInterruptsTheJobAndIsBackWithoutARestart) {
  start();
  begin_scan();
  ASSERT_TRUE(wait_stored(1)) << log();
  plug_right(false);
  ASSERT_TRUE(soon([&] { return jobs().back()["state"] == "interrupted"; })) << log();
  EXPECT_THAT(job()["error"]["message"].get<std::string>(), HasSubstr("right camera"));
  EXPECT_TRUE(soon([&] { return camera_problem().find("right camera") != std::string::npos; })) << camera_problem();
  plug_right(true);
  EXPECT_TRUE(soon([&] { return camera_problem().empty(); })) << camera_problem();
  EXPECT_TRUE(preview_comes());
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  begin_scan();
  EXPECT_TRUE(wait_stored(1)) << log();
}

TEST_F(CamerasOnWires, TheCommandListsTunesGrabsAndPreviews) {
  start_rig({"--cameras", "gige", "--scale", "0.25"});
  const auto pictures = folder_ / "pictures";
  EXPECT_EQ(Process({SCANRIG_PROGRAM, "camera", "list"}, folder_ / "output").wait(), 0);
  EXPECT_THAT(*read_file(folder_ / "output"), AllOf(HasSubstr("40012345"), HasSubstr("40012346")));
  EXPECT_EQ(scanrig({"camera", "tune", "--count", "2"}), 0) << output_;
  EXPECT_THAT(output_, HasSubstr("right  brightness"));
  EXPECT_EQ(scanrig({"camera", "grab", "--light", "pattern", "--out", pictures}), 0) << output_;
  EXPECT_TRUE(std::filesystem::exists(pictures / "left.png"));
  EXPECT_EQ(scanrig({"camera", "grab", "--out", pictures}), static_cast<int>(ExitCode::bad_input)) << "already there";
  EXPECT_EQ(scanrig({"camera", "preview", "--count", "2", "--out", pictures}), 0) << output_;
  EXPECT_TRUE(std::filesystem::exists(pictures / "right.jpg"));
  std::filesystem::remove(pictures / "right.jpg");
  start_daemon({SCANRIGD_PROGRAM});
  EXPECT_EQ(scanrig({"camera", "tune", "--count", "1"}), static_cast<int>(ExitCode::refused)) << "the daemon has them";
  EXPECT_EQ(scanrig({"camera", "preview", "--count", "3", "--out", pictures}), 0) << output_;
  EXPECT_TRUE(std::filesystem::exists(pictures / "right.jpg"));
}

}  // namespace
}  // namespace scanrig
