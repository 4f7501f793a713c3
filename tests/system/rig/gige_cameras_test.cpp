#include "pipeline/scan/scan_folder.h"
#include "sim/wire/gige_camera.h"
#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

using sim::wire::hidden_number;

/// The shipped daemon with every one of its drivers, cameras too.
class CamerasOnWires : public RigOnWires {};

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

}  // namespace
}  // namespace scanrig
