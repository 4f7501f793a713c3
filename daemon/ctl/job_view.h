#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/ctl/output.h"

namespace scanrig::ctl {
/// Why the last Start did not start `job`; nothing if it did, or still may. `status` as GET status gives it.
std::optional<Error> why_not_started(const nlohmann::json& status, const std::string& job);

/// Prints a job's progress line by line from the API's replies, repeatedly.
class JobStory {
 public:
  explicit JobStory(StageBars& bars) : bars_(bars) {}

  /// Without an active job: prints what the station waits for, when that has changed.
  void wait(const nlohmann::json& status);

  /// `status` and `job` as GET status and GET jobs/ID give them. Returns true when the job is over.
  bool tell(const nlohmann::json& status, const nlohmann::json& job);

  /// Result of the job: `ok`, or the exit code of its error, which is printed on stderr. A model that does not pass is
  /// an error, too.
  [[nodiscard]] ExitCode end(const nlohmann::json& job);

 private:
  StageBars& bars_;
  std::size_t views_told_ = 0;
  std::size_t movement_checks_reported_ = 0;
  bool introduced_ = false;
  std::string waited_{};     ///< the last printed cause of a wait
  std::string asked_ = "-";  ///< the last action requested from the operator
  RealClock clock_;
  Clock::TimePoint begun_ = clock_.now();
};

/// Summary of one job for a person: `job` as GET jobs/ID gives it.
std::vector<std::string> job_lines(const nlohmann::json& job);

}  // namespace scanrig::ctl
