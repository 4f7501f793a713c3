#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/clock.h"
#include "core/files.h"
#include "daemon/ctl/client.h"
#include "sim/wire/control_socket.h"
#include "tests/system/daemon/process.h"

namespace scanrig {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using testing::HasSubstr;

/// The programs as they are shipped, on the wires of a simulated rig; the test is the hand at the panel.
class RigOnWires : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    daemon_.reset();
    rig_.reset();
    std::filesystem::remove_all(folder_);
  }
  void start_rig(std::vector<std::string> more = {}) {
    std::vector<std::string> command{SCANRIG_SIM_PROGRAM,     "rig",  "--dir",   folder_, "--speed-deg-s", "180",
                                     "--acceleration-deg-s2", "1000", "--views", "4"};
    command.insert(command.end(), more.begin(), more.end());
    rig_.emplace(command, folder_ / "rig.log");
    ASSERT_TRUE(soon([&] { return say({{"get", "truth"}}).contains("angle_deg"); }));
  }
  void start_daemon() {
    daemon_.emplace(std::vector<std::string>{SCANRIGD_SIM_PROGRAM, "--config", folder_ / "rig.toml", "--scale", "0.25"},
                    folder_ / "daemon.log");
    ASSERT_TRUE(soon([&] { return machine() == "Halted" && next_action().starts_with("Press Reset"); })) << log();
  }
  json say(const json& request) {
    const auto answer = sim::wire::say_to_control_socket(folder_ / "control.sock", request.dump());
    return answer ? json::parse(*answer) : json::object();
  }
  /// Held until it has its effect.
  template <class Effect>
  bool press_until(const char* button, const Effect& effect) {
    say({{"press", button}});
    const bool came = soon(effect);
    say({{"release", button}});
    return came;
  }
  template <class Ready>
  bool soon(const Ready& ready, std::chrono::seconds limit = std::chrono::seconds(60)) {
    for (const auto by = Deadline::after(clock_, limit); !by.expired(clock_); clock_.sleep_for(milliseconds(20))) {
      if (ready()) return true;
    }
    return false;
  }
  json ask(const std::string& target) {
    const auto answer = ctl::ask(folder_ / "api.sock", "GET", "/api/v1/" + target);
    return answer ? *answer : json::object();
  }
  std::string machine() { return ask("status").value("machine", ""); }
  std::string next_action() { return ask("status").value("next_action", ""); }
  std::string log() { return read_file(folder_ / "daemon.log").value_or(""); }
  int scanrig(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), SCANRIG_PROGRAM);
    arguments.insert(arguments.end(), {"--config", folder_ / "rig.toml"});
    const int code = Process(arguments, folder_ / "output").wait();
    output_ = *read_file(folder_ / "output");
    return code;
  }

  RealClock clock_;
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string("wires_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  std::optional<Process> rig_, daemon_;
  std::string output_;
};

TEST_F(RigOnWires, AJobGoesFromResetToTheModel) {
  start_rig({"--panel", "modbus-io"});
  start_daemon();
  const auto lamp = [&](const char* name) { return say({{"get", "outputs"}}).value(name, false); };
  ASSERT_TRUE(press_until("reset", [&] { return machine() != "Halted"; })) << log();
  ASSERT_TRUE(soon([&] { return machine() == "Operational.Ready"; })) << log();
  ASSERT_TRUE(press_until("start", [&] { return machine() == "Operational.SingleExecution"; })) << log();
  ASSERT_TRUE(soon([&] { return lamp("flip_request"); })) << log();
  ASSERT_TRUE(press_until("start", [&] { return !lamp("flip_request"); })) << log();
  const auto job = [&] { return ask("jobs").value("jobs", json::array()); };
  ASSERT_TRUE(soon([&] { return !job().empty() && job()[0]["state"] == "done"; })) << log() << job();
  const auto told = ask("jobs/" + job()[0]["id"].get<std::string>());
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
  EXPECT_THAT(output_, HasSubstr("standing"));
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
  EXPECT_THAT(output_, HasSubstr("wrong_parity"));
  EXPECT_THAT(output_, HasSubstr("Set parity = \"even\""));
  say({{"set", {{"fault", "silent"}}}});
  EXPECT_EQ(scanrig({"doctor"}), 5);
  EXPECT_THAT(output_, HasSubstr("no_answer"));
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
