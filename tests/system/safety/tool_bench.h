#pragma once

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "tests/component/safety/wire_rig.h"
#include "tests/system/daemon/process.h"

namespace scanrig {

/// A light table, so that real time is short.
inline const sim::wire::AxisOptions kToolAxis{.gear_ratio = 9, .start_deg = 150};
inline const WireRig::Changes kToolSpeeds{{"speed_deg_s = 45", "speed_deg_s = 120"},
                                          {"acceleration_deg_s2 = 90", "acceleration_deg_s2 = 480"},
                                          {"settle_ms = 200", "settle_ms = 60"}};

/// A command line of `scanrig` that moves the table.
using Tool = std::vector<std::string>;
inline const Tool kHome{"turntable", "home", "--yes"};
inline const Tool kMove{"turntable", "move", "90", "--yes"};
inline const Tool kDoctor{"doctor", "--allow-motion"};

/// A rig on wires and one run of a tool on it.
class ToolBench {
 public:
  void start(Tool tool) {
    tool.insert(tool.begin(), SCANRIG_PROGRAM);
    tool.insert(tool.end(), {"--config", rig.config().string()});
    tool_.emplace(tool, output_);
  }
  void signal(int number) const { tool_->signal(number); }
  int wait() { return tool_->wait(); }
  int run(const Tool& tool) {
    start(tool);
    return wait();
  }
  [[nodiscard]] std::string output() const { return read_file(output_).value_or(""); }
  [[nodiscard]] bool is_moving() const { return rig.drive.truth().moving; }
  /// Time from `event` to the last seen motion of the table; watches it for `watched`.
  Clock::Duration moving_after(Clock::TimePoint event, Clock::Duration watched) {
    auto last = event;
    for (const auto end = rig.clock.now() + watched; rig.clock.now() < end;
         rig.clock.sleep_for(std::chrono::milliseconds(2))) {
      if (is_moving()) last = rig.clock.now();
    }
    return last - event;
  }
  /// Process that guards this rig's tool; 0: none.
  [[nodiscard]] pid_t guardian() const {
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      std::ifstream name(entry.path() / "comm"), arguments(entry.path() / "cmdline");
      std::string comm, command;
      std::getline(name, comm);
      std::getline(arguments, command);
      if (comm == "motion-guardian" && command.find(rig.config().string()) != std::string::npos) {
        return std::stoi(entry.path().filename());
      }
    }
    return 0;
  }

  WireRig rig{kToolAxis, kToolSpeeds};

 private:
  std::filesystem::path output_ = rig.folder / "tool.log";
  std::optional<Process> tool_;
};

}  // namespace scanrig
