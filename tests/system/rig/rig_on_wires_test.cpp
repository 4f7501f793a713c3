#include "tests/system/rig/rig_on_wires.h"

#include <cmath>

namespace scanrig {
namespace {

using testing::HasSubstr;

TEST_F(RigOnWires, AJobGoesFromResetToTheModel) {
  start_rig({"--panel", "modbus-io"});
  start_daemon();
  ASSERT_TRUE(press_until("reset", [&] { return machine() != "Halted"; })) << log();
  ASSERT_TRUE(soon([&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  ASSERT_TRUE(soon([&] { return lamp("flip_request"); })) << log();
  ASSERT_TRUE(press_until("start", [&] { return !lamp("flip_request"); })) << log();
  ASSERT_TRUE(soon([&] { return !jobs().empty() && jobs()[0]["state"] == "done"; })) << log() << jobs();
  const auto told = ask("jobs/" + jobs()[0]["id"].get<std::string>());
  const auto scan = json::parse(*read_file(std::filesystem::path(told["folder"]) / "scan.json"));
  for (const auto& pose : scan["poses"]) {
    ASSERT_EQ(pose["views"].size(), 4u);
    for (const auto& view : pose["views"]) {
      const double off = view["measured_deg"].get<double>() - view["commanded_deg"].get<double>();
      EXPECT_NEAR(std::remainder(off, 360.0), 0.0, 0.02);
      EXPECT_GT(view["settling_ms"], 0);
    }
  }
}

TEST_F(RigOnWires, TheTurntableIsMovedOnlyByConsentAndWhileNoDaemonHasIt) {
  start_rig();
  const double before = say({{"get", "truth"}})["angle_deg"];
  EXPECT_EQ(scanrig({"turntable", "move", "90"}), 6);
  EXPECT_THAT(output_, HasSubstr("--yes"));
  EXPECT_EQ(say({{"get", "truth"}})["angle_deg"], before);
  EXPECT_EQ(scanrig({"turntable", "move", "90", "--yes"}), 0) << output_;
  EXPECT_NEAR(std::remainder(say({{"get", "truth"}})["angle_deg"].get<double>() - 90, 360.0), 0, 0.5);
  EXPECT_EQ(scanrig({"turntable", "read", "--json"}), 0);
  EXPECT_NEAR(json::parse(output_)["angle_deg"], 90, 0.02);
  EXPECT_EQ(scanrig({"turntable", "status"}), 0);
  EXPECT_THAT(output_, HasSubstr("motion: stopped"));
  EXPECT_EQ(scanrig({"panel", "watch", "--seconds", "1"}), 0);
  EXPECT_THAT(output_, HasSubstr("e-stop ok"));

  start_daemon();
  for (const auto& verb : std::vector<std::vector<std::string>>{
           {"turntable", "home", "--yes"}, {"turntable", "status"}, {"panel", "watch"}, {"doctor"}}) {
    EXPECT_EQ(scanrig(verb), 6) << verb[0];
    EXPECT_THAT(output_, HasSubstr("scanrigd holds the rig"));
  }
}

TEST_F(RigOnWires, TheDoctorPraisesASoundRigAndNamesAWrongParity) {
  start_rig();
  EXPECT_EQ(scanrig({"doctor", "--json"}), 0) << output_;
  EXPECT_TRUE(json::parse(output_)["findings"].empty());
  say({{"set", {{"line", {{"parity", "even"}}}}}});
  EXPECT_EQ(scanrig({"doctor"}), 5);
  EXPECT_THAT(output_, HasSubstr("scanrig: "));
  EXPECT_THAT(output_, HasSubstr("wrong_parity"));
  EXPECT_THAT(output_, HasSubstr("Set parity = \"even\""));
  say({{"set", {{"fault", "silent"}}}});
  EXPECT_EQ(scanrig({"doctor"}), 5);
  EXPECT_THAT(output_, HasSubstr("no_answer"));
}

TEST_F(RigOnWires, ADeviceThatIsGoneIsADeviceAndNoFile) {
  start_rig();
  rig_.reset();
  for (const auto& verb :
       std::vector<std::vector<std::string>>{{"turntable", "status"}, {"turntable", "read"}, {"panel", "watch"}}) {
    EXPECT_EQ(scanrig(verb), static_cast<int>(ExitCode::device)) << verb[0] << " " << verb[1] << ": " << output_;
  }
}

TEST_F(RigOnWires, TheSimulatedRigEndsCleanly) {
  start_rig();
  rig_->signal(SIGTERM);
  EXPECT_EQ(rig_->wait(), 0);
  for (const char* name : {"turntable", "gpio.sock", "control.sock"}) {
    EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(folder_ / name))) << name;
  }
}

}  // namespace
}  // namespace scanrig
