#include "daemon/api/metrics.h"

#include <gmock/gmock.h>

#include <regex>
#include <set>
#include <sstream>

#include "tests/unit/daemon/api/station_without_rig.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

std::string sample() {
  Snapshot snapshot{.machine = MachineState::ready, .jobs = one_job("old", "/jobs")};
  snapshot.devices = {{"turntable", {}}, {"camera \"left\"\n\\", Error{ErrorCode::timeout, "silent"}}};
  snapshot.counters = {.views_stored = 16, .retakes = 2, .stage_seconds = {{"volume", 1.5}}};
  return metrics_text(snapshot, {.disk_bytes = 1000, .disk_free_bytes = 250, .temperatures = {{"cpu", 41.5}}});
}

TEST(Metrics, TellStateCountersAndMachine) {
  const auto text = sample();
  for (const auto* line :
       {"scanrig_machine_state{state=\"Operational.Ready\"} 1\n", "scanrig_machine_state{state=\"Error\"} 0\n",
        "scanrig_device_up{device=\"turntable\"} 1\n", "scanrig_device_up{device=\"camera \\\"left\\\" \\\\\"} 0\n",
        "scanrig_jobs{state=\"failed\"} 1\n", "scanrig_views_stored_total 16\n", "scanrig_retakes_total 2\n",
        "scanrig_retries_total 2\n", "scanrig_deadlines_missed_total 0\n",
        "scanrig_stage_seconds_total{stage=\"volume\"} 1.5\n", "scanrig_disk_free_bytes 250\n",
        "scanrig_temperature_celsius{sensor=\"cpu\"} 41.5\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(Metrics, EachNameIsExplainedOnceBeforeItsValues) {
  const std::regex value(R"re((scanrig_[a-z_]+)(\{[a-z]+="([^"\\]|\\.)*"\})? -?[0-9.e+-]+)re");
  std::set<std::string> explained;
  std::istringstream lines(sample());
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    std::smatch parts;
    if (line.starts_with("# HELP ")) {
      last = line.substr(7, line.find(' ', 7) - 7);
      EXPECT_TRUE(explained.insert(last).second) << line;
    } else if (!line.starts_with("# TYPE ")) {
      ASSERT_TRUE(std::regex_match(line, parts, value)) << line;
      EXPECT_EQ(parts[1], last) << line;
    }
  }
}

}  // namespace
}  // namespace scanrig
