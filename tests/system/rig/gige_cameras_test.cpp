#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "sim/apps/rig_cameras.h"
#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

using sim::faint_number;
using testing::AllOf;
using testing::HasSubstr;

/// The shipped daemon with every one of its drivers, cameras too.
class CamerasOnWires : public RigOnWires {
 protected:
  /// Views per pose: these tests mostly render.
  void start() {
    start_rig({"--cameras", "gige", "--scale", "0.25", "--poses", "1"});
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
  /// Record of the newest job.
  json job() { return ask("jobs/" + jobs().back()["id"].get<std::string>()); }
  bool wait_stored(std::size_t views) {
    return soon([&] { return !jobs().empty() && job()["stored"].size() >= views; });
  }
  /// Problem of the cameras; empty: none.
  std::string camera_problem() {
    const auto devices = ask("status")["devices"];
    for (const auto& device : devices) {
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
  start_rig({"--cameras", "gige", "--scale", "0.25", "--number-frames", "--camera-state", "7"});
  start_daemon({SCANRIGD_PROGRAM});
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_EQ(say({{"set", {{"camera_fault", "lost"}, {"camera", "right"}}}})["ok"], true);
  ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  ASSERT_TRUE(soon([&] { return lamp("flip_request"); })) << log();
  ASSERT_EQ(say({{"turn_over", true}})["ok"], true);
  ASSERT_TRUE(press_until("start", [&] { return !lamp("flip_request"); })) << log();
  ASSERT_TRUE(soon([&] { return !jobs().empty() && jobs()[0]["state"] == "done"; })) << log() << jobs();

  const auto job = ask("jobs/" + jobs()[0]["id"].get<std::string>());
  const std::filesystem::path folder(job["folder"].get<std::string>());
  ASSERT_GE(job["stored"][0]["retakes"], 1);
  EXPECT_THAT(job["stored"][0]["retake_reasons"].dump(), HasSubstr("right camera SIM-R: no frame"));
  EXPECT_THAT(*read_file(folder / "scan.json"), HasSubstr("right camera SIM-R: no frame"));
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const auto& stored = job["stored"][i];
    const auto retakes = stored["retakes"].get<std::uint32_t>();  // on a busy machine more than the lost one
    EXPECT_EQ(stored["retake_reasons"].size(), retakes);
    const auto view =
        folder / fmt::format("pose{}/view{:02}", stored["pose"].get<int>() + 1, stored["view"].get<int>());
    const auto edge_of = [&](const char* name) { return faint_number(cv::imread(view / name, cv::IMREAD_UNCHANGED)); };
    const auto pattern = edge_of("left_pattern.png"), plain = edge_of("left_plain.png");
    EXPECT_EQ(edge_of("right_pattern.png"), pattern);
    EXPECT_EQ(edge_of("right_plain.png"), plain);
    EXPECT_GT(pattern, last);
    EXPECT_GT(plain, pattern);
    if (i != 4) {  // after a pose view 0 was checked again
      EXPECT_LE(plain, last + 2 + retakes);
    }
    last = plain;
  }
  EXPECT_TRUE(std::filesystem::exists(job["model"].get<std::string>()));
}

TEST_F(CamerasOnWires, ImagesThatAreDarkBlurredOrOfTheOtherSideAreRetaken) {
  start();
  spoil("dark", 2);
  begin_scan();
  ASSERT_TRUE(wait_stored(1)) << log();
  EXPECT_GE(job()["stored"][0]["retakes"], 2);
  EXPECT_THAT(job()["stored"][0]["retake_reasons"].dump(), HasSubstr("right camera: the pattern image is dark"));
  spoil("swapped", 2);
  ASSERT_TRUE(wait_stored(3)) << log();
  spoil("blurred", 2);
  ASSERT_TRUE(soon([&] { return job()["state"] == "reconstructing"; })) << log();
  int retakes = 0;
  const auto stored = job()["stored"];
  for (const auto& view : stored) retakes += view["retakes"].get<int>();
  EXPECT_GE(retakes, 4) << "of two bad exposures at least one was with the pattern";
}

TEST_F(CamerasOnWires, ACameraThatStaysDarkEndsTheJobInItsName) {
  views_ = 3;  // the minimum
  start();
  spoil("dark", 100);
  begin_scan();
  ASSERT_TRUE(soon([&] { return !jobs().empty() && jobs().back()["state"] == "interrupted"; })) << log();
  EXPECT_THAT(job()["error"]["message"].get<std::string>(), HasSubstr("right camera: the pattern image is dark"));
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
  views_ = 3;  // the minimum
  start_rig({"--cameras", "gige", "--scale", "0.25", "--poses", "1"});
  const auto images = folder_ / "images";
  EXPECT_EQ(Process({SCANRIG_PROGRAM, "camera", "list"}, folder_ / "output").wait(), 0);
  EXPECT_THAT(*read_file(folder_ / "output"), AllOf(HasSubstr("SIM-L"), HasSubstr("SIM-R")));
  EXPECT_EQ(scanrig({"camera", "tune", "--count", "2"}), 0) << output_;
  EXPECT_THAT(output_, HasSubstr("right  brightness"));
  EXPECT_EQ(scanrig({"camera", "grab", "--light", "pattern", "--out", images}), 0) << output_;
  EXPECT_TRUE(std::filesystem::exists(images / "left.png"));
  EXPECT_THAT(output_, HasSubstr((images / "left.png").string() + "\n" + (images / "right.png").string() + "\n"));
  EXPECT_EQ(scanrig({"camera", "grab", "--out", images}), static_cast<int>(ExitCode::bad_input)) << "already there";
  EXPECT_EQ(scanrig({"camera", "preview", "--count", "2", "--out", images}), 0) << output_;
  EXPECT_TRUE(std::filesystem::exists(images / "right.jpg"));
  std::filesystem::remove(images / "right.jpg");
  start_daemon({SCANRIGD_PROGRAM});
  EXPECT_EQ(scanrig({"camera", "tune", "--count", "1"}), static_cast<int>(ExitCode::refused)) << "the daemon has them";
  EXPECT_EQ(scanrig({"camera", "preview", "--count", "3", "--out", images}), 0) << output_;
  EXPECT_TRUE(std::filesystem::exists(images / "right.jpg"));
}

TEST_F(CamerasOnWires, TheCommandTellsProgramsInJsonALineAPair) {
  views_ = 3;  // the minimum
  start_rig({"--cameras", "gige", "--scale", "0.25", "--poses", "1"});
  const auto lines = [this] {
    std::vector<json> all;
    std::istringstream text(output_);
    for (std::string line; std::getline(text, line);) all.push_back(json::parse(line, nullptr, false));
    return all;
  };
  const auto images = folder_ / "images";
  const auto files = [&](const char* ending) {
    return json{{"left", images / (std::string("left") + ending)}, {"right", images / (std::string("right") + ending)}};
  };
  EXPECT_EQ(scanrig({"camera", "tune", "--light", "pattern", "--count", "2", "--json"}), 0) << output_;
  ASSERT_EQ(lines().size(), 2u) << output_;
  for (const auto& pair : lines()) {
    for (const auto* side : {"left", "right"}) {
      EXPECT_THAT(pair[side]["brightness"].get<double>(), AllOf(testing::Ge(0.0), testing::Le(1.0))) << pair;
      EXPECT_TRUE(pair[side]["saturated"].is_number()) << pair;
      EXPECT_TRUE(pair[side]["blur_px"].is_number() || pair[side]["blur_px"].is_null())
          << "null: nothing to measure it on";
      EXPECT_TRUE(pair[side]["advice"].is_string()) << pair;
    }
  }
  EXPECT_EQ(scanrig({"camera", "grab", "--out", images, "--json"}), 0) << output_;
  EXPECT_EQ(lines(), std::vector<json>{files(".png")});
  EXPECT_EQ(scanrig({"camera", "preview", "--count", "2", "--out", images, "--json"}), 0) << output_;
  EXPECT_EQ(lines(), (std::vector<json>{files(".jpg"), files(".jpg")}));
  EXPECT_TRUE(std::filesystem::exists(images / "right.jpg"));
}

}  // namespace
}  // namespace scanrig
