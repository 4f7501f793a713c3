// An unknown rig is calibrated by the shipped programs, with a simulated operator who puts the board where the service
// says, and scans with its own calibration.
#include "pipeline/storage/calibration_file.h"
#include "tests/system/daemon/programs.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CalibrateRig : public Programs {
 protected:
  void boot_drawn_rig() {
    daemon.emplace(std::vector<std::string>{SCANRIGD_SIM_PROGRAM, "--socket", socket(), "--jobs", folder_ / "jobs",
                                            "--rig-seed", "5", "--scale", "0.5", "--views", "4", "--clock", "virtual",
                                            "--operator", "helper", "--voxel-mm", "1"},
                   folder_ / "daemon.log");
  }
  json wait_for(const char* what, const std::string& begin) {
    return ask_until("status", [&](const json& now) { return now[what].get<std::string>().starts_with(begin); });
  }
  fs::path calibration() const { return folder_ / "jobs" / "calibration.json"; }
};

TEST_F(CalibrateRig, FromNothingToAScan) {
  boot_drawn_rig();
  wait_for("machine", "Operational.Ready");
  EXPECT_EQ(scanrig({"start", "--socket", socket()}), 6) << "nothing is known of this rig: " << output;
  EXPECT_FALSE(fs::exists(calibration()));

  ASSERT_EQ(scanrig({"calibrate", "--rig", "--socket", socket()}), 0) << output;
  EXPECT_THAT(output, HasSubstr("Calibration of grade "));
  EXPECT_FALSE(fs::exists(calibration())) << "not accepted yet";
  const auto job = ask_until("jobs", [](const json& all) { return all["jobs"][0]["state"] == "done"; });
  const auto report = read_file(folder_ / "jobs" / job["jobs"][0]["id"].get<std::string>() / "calibration.html");
  EXPECT_THAT(report.value_or(""), HasSubstr("</html>"));
  ASSERT_EQ(scanrig({"calibrate", "--accept", "--socket", socket()}), 0) << output;
  const auto solved = read_calibration(calibration());
  ASSERT_TRUE(solved) << solved.error().message;
  ASSERT_TRUE(solved->quality);
  EXPECT_LT(solved->quality->volume_um, 15.0);
  EXPECT_GT(solved->quality->rim_dots.size(), 20u);
  EXPECT_EQ(solved->left.serial, "SIM-L");

  ASSERT_EQ(scanrig({"calibrate", "--check", "--socket", socket()}), 0) << output;
  EXPECT_THAT(output, HasSubstr("The calibration holds: "));

  wait_for("machine", "Operational.Ready");
  EXPECT_EQ(scanrig({"start", "--follow", "--socket", socket()}), 0) << output;
  EXPECT_THAT(output, HasSubstr("model.glb"));
}

}  // namespace
}  // namespace scanrig
