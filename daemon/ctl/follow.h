#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/result.h"
#include "daemon/ctl/stage_bars.h"

namespace scanrig::ctl {

/// Tells a job's story line by line from what the API says of it, again and again.
class JobStory {
 public:
  explicit JobStory(StageBars& bars) : bars_(bars) {}

  /// `status` and `job` as GET status and GET jobs/ID give them. Returns true when the job is over.
  bool tell(const nlohmann::json& status, const nlohmann::json& job);

  /// How the job ended: `ok`, or the exit code of its error, which is told on stderr.
  [[nodiscard]] ExitCode end(const nlohmann::json& job);

 private:
  StageBars& bars_;
  std::size_t views_told_ = 0;
  std::size_t closures_told_ = 0;
  bool introduced_ = false;
  std::string asked_ = "-";  ///< what the operator was last asked to do
  RealClock clock_;
  Clock::TimePoint begun_ = clock_.now();
};

}  // namespace scanrig::ctl
