#pragma once

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "core/clock.h"
#include "core/files.h"
#include "daemon/ctl/client.h"
#include "sim/wire/control_socket.h"
#include "tests/own_folder.h"
#include "tests/slowness.h"
#include "tests/system/daemon/process.h"

namespace scanrig {

using nlohmann::json;

/// The shipped programs, on the wires of a simulated rig; the test operates the panel.
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
  /// The expected views are rendered when this returns: a frame that is late is lost.
  void start_rig(std::vector<std::string> more = {}) {
    std::vector<std::string> command{SCANRIG_SIM_PROGRAM,
                                     "rig",
                                     "--dir",
                                     folder_,
                                     "--speed-deg-s",
                                     std::to_string(speed_deg_s_),
                                     "--acceleration-deg-s2",
                                     "1000",
                                     "--views",
                                     std::to_string(views_)};
    command.insert(command.end(), more.begin(), more.end());
    rig_.emplace(command, folder_ / "rig.log");
    const auto ready = [&] {
      return read_file(folder_ / "rig.log").value_or("").find("rig ready") != std::string::npos;
    };
    ASSERT_TRUE(soon(ready, std::chrono::seconds(120))) << read_file(folder_ / "rig.log").value_or("");
  }
  void start_daemon(const std::vector<std::string>& program = {SCANRIGD_SIM_PROGRAM, "--scale", "0.25"}) {
    std::vector<std::string> command = program;
    command.insert(command.end(), {"--config", folder_ / "rig.toml"});
    daemon_.emplace(command, folder_ / "daemon.log");
    ASSERT_TRUE(soon([&] { return machine() == "Halted" && next_action().starts_with("Press Reset"); })) << log();
  }
  json say(const json& request) {
    const auto answer = sim::wire::send_to_control_socket(folder_ / "control.sock", request.dump());
    return answer ? json::parse(*answer) : json::object();
  }
  /// Held until it has an effect.
  template <class Effect>
  bool press_until(const char* button, const Effect& effect) {
    say({{"press", button}});
    const bool came = soon(effect);
    say({{"release", button}});
    return came;
  }
  template <class Ready>
  bool soon(const Ready& ready, std::chrono::seconds limit = std::chrono::seconds(60)) {
    for (const auto by = Deadline::after(clock_, kSlowness * limit); !by.expired(clock_);
         clock_.sleep_for(std::chrono::milliseconds(20))) {
      if (ready()) return true;
    }
    return false;
  }
  json ask(const std::string& target) {
    const auto answer = ctl::send_request(folder_ / "api.sock", "GET", "/api/v1/" + target);
    return answer ? *answer : json::object();
  }
  std::string machine() { return ask("status").value("machine", ""); }
  std::string next_action() { return ask("status").value("next_action", ""); }
  std::string log() { return read_file(folder_ / "daemon.log").value_or(""); }
  bool lamp(const char* name) { return say({{"get", "outputs"}}).value(name, false); }
  json jobs() { return ask("jobs").value("jobs", json::array()); }
  int scanrig(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), SCANRIG_PROGRAM);
    arguments.insert(arguments.end(), {"--config", folder_ / "rig.toml"});
    const int code = Process(arguments, folder_ / "output").wait();
    output_ = read_file(folder_ / "output").value_or("");
    return code;
  }

  RealClock clock_;
  int views_ = 4;  ///< per pose; GigE cameras have them all rendered before the rig is ready
  int speed_deg_s_ = 180;
  const std::filesystem::path folder_ = own_folder("wires_");
  std::optional<Process> rig_, daemon_;
  std::string output_;
};

}  // namespace scanrig
