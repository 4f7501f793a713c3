#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/ctl/output.h"

namespace scanrig::ctl {
/// Why the last Start did not begin `job`; nothing if it did, or still may. `status` as GET status gives it.
std::optional<Error> why_not_started(const nlohmann::json& status, const std::string& job);

/// Tells a job's story line by line from what the API says of it, again and again.
class JobStory {
 public:
  explicit JobStory(StageBars& bars) : bars_(bars) {}

  /// No job has the rig yet: tells what the station waits for, when that is another thing.
  void wait(const nlohmann::json& status);

  /// `status` and `job` as GET status and GET jobs/ID give them. Returns true when the job is over.
  bool tell(const nlohmann::json& status, const nlohmann::json& job);

  /// How the job ended: `ok`, or the exit code of its error, which is told on stderr. A model that does not pass is
  /// an error, too.
  [[nodiscard]] ExitCode end(const nlohmann::json& job);

 private:
  StageBars& bars_;
  std::size_t views_told_ = 0;
  std::size_t movement_checks_reported_ = 0;
  bool introduced_ = false;
  std::string waited_{};     ///< the cause of the last wait told
  std::string asked_ = "-";  ///< what the operator was last asked to do
  RealClock clock_;
  Clock::TimePoint begun_ = clock_.now();
};

/// What a person wants to know of one job: `job` as GET jobs/ID gives it.
std::vector<std::string> job_lines(const nlohmann::json& job);

}  // namespace scanrig::ctl
