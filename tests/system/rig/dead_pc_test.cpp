#include <cmath>

#include "tests/system/rig/rig_on_wires.h"

namespace scanrig {
namespace {

/// The service is dead and nothing makes the rig safe: no systemd, no PC. Only the drive's own time-out is left.
class DeadPc : public RigOnWires {
 protected:
  DeadPc() { speed_deg_s_ = 6; }  // a quarter turn takes 15 s

  json truth() { return say({{"get", "truth"}}); }
  bool is_turning() { return std::abs(truth().value("speed_deg_s", 0.0)) > 1; }
  /// How far the table still turns after the service was killed in the middle of a job's turn.
  double degrees_after_the_end() {
    EXPECT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
    EXPECT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
    EXPECT_TRUE(soon([&] { return is_turning(); })) << log();
    const double before = truth()["angle_deg"];
    EXPECT_TRUE(soon([&] { return std::abs(truth()["angle_deg"].get<double>() - before) > 6; })) << "the turn itself";
    daemon_->signal(SIGKILL);
    daemon_->wait();
    const double killed = truth()["angle_deg"];
    EXPECT_TRUE(soon([&] { return truth().value("stopped", false); }));
    return std::abs(truth()["angle_deg"].get<double>() - killed);
  }
};

TEST_F(DeadPc, ADriveWithACommunicationTimeoutStopsTheTableByItself) {
  start_rig({"--drive", "oriental-az"});
  start_daemon();
  const double turned = degrees_after_the_end();
  EXPECT_LT(turned, 3 * speed_deg_s_ + 8) << "3 s of the profile, and some";
  EXPECT_GT(turned, 6) << "it was turning";
  daemon_.emplace(std::vector<std::string>{SCANRIGD_SIM_PROGRAM, "--scale", "0.25", "--config", folder_ / "rig.toml"},
                  folder_ / "daemon.log");
  ASSERT_TRUE(soon([&] { return next_action().find("ress Reset") != std::string::npos; })) << log();
  ASSERT_TRUE(press_until("reset", [&] { return machine() == "Operational.Ready"; })) << log();
}

/// The profile states that it has none; the last command to the drive is carried out to its end.
TEST_F(DeadPc, ADriveWithoutOneEndsTheTurnThatHadBegun) {
  start_rig();
  start_daemon();
  EXPECT_GT(degrees_after_the_end(), 40);
}

}  // namespace
}  // namespace scanrig
