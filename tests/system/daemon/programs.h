#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/files.h"
#include "daemon/ctl/client.h"
#include "tests/slowness.h"
#include "tests/system/daemon/process.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {

using nlohmann::json;

/// The shipped programs, against each other; small images, and a rig without waiting times.
class Programs : public scan_samples::FolderTest {
 protected:
  void TearDown() override {
    daemon.reset();
    FolderTest::TearDown();
  }
  void boot(const std::string& operator_at_rig, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{SCANRIGD_SIM_PROGRAM,
                                     "--socket",
                                     socket(),
                                     "--jobs",
                                     folder_ / "jobs",
                                     "--scale",
                                     "0.25",
                                     "--views",
                                     "4",
                                     "--clock",
                                     "virtual",
                                     "--operator",
                                     operator_at_rig,
                                     "--voxel-mm",
                                     "1"};
    command.insert(command.end(), more.begin(), more.end());
    daemon.emplace(command, folder_ / "daemon.log");
  }
  int scanrig(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), SCANRIG_PROGRAM);
    const int code = Process(arguments, folder_ / "output").wait();
    output = read_file(folder_ / "output").value_or("");
    return code;
  }
  std::string socket() const { return folder_ / "api.sock"; }

  /// Repeats a request until the reply is as wanted; null after two minutes, in a build without a sanitizer.
  template <class Wanted>
  json ask_until(const std::string& target, const Wanted& wanted) {
    RealClock clock;
    for (const auto end = Deadline::after(clock, kSlowness * std::chrono::minutes(2)); !end.expired(clock);
         clock.sleep_for(std::chrono::milliseconds(20))) {
      const auto answer = ctl::send_request(socket(), "GET", "/api/v1/" + target);
      if (answer && wanted(*answer)) return *answer;
    }
    ADD_FAILURE() << target << " never became as wanted; the daemon said: " << *read_file(folder_ / "daemon.log");
    return nullptr;
  }
  /// The only job, once at least `views` of its views are acknowledged.
  json job_with_views(int views) {
    const auto jobs = ask_until("jobs", [&](const json& answer) {
      return !answer["jobs"].empty() && answer["jobs"][0]["stored"].get<int>() >= views;
    });
    const auto answer = ctl::send_request(socket(), "GET", "/api/v1/jobs/" + jobs["jobs"][0]["id"].get<std::string>());
    return answer ? *answer : json();
  }
  static void expect_readable(const json& job) {
    const auto scan = ScanFolder::open(job["folder"].get<std::string>());
    ASSERT_TRUE(scan) << scan.error().message;
    for (const auto& stored : job["stored"]) {
      const auto images = scan->load_images(stored["pose"].get<std::size_t>(), stored["view"].get<std::size_t>());
      EXPECT_TRUE(images) << images.error().message;
    }
  }

  std::optional<Process> daemon;
  std::string output;
};

}  // namespace scanrig
