#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/jobs/system_time.h"

namespace scanrig {

struct RetentionOptions {
  std::optional<std::chrono::days> keep_for{};  ///< empty: for ever
  std::optional<std::uintmax_t> keep_bytes{};   ///< of all jobs together; empty: no limit
  std::shared_ptr<const SystemTime> time = system_time();
};

/// One job that has ended.
struct KeptJob {
  std::string id;
  std::chrono::seconds age{0};  ///< from RetentionLedger
  std::uint64_t number = 0;     ///< in the order of ending
  std::uintmax_t bytes = 0;
  bool is_removable = false;  ///< exported, and cannot be resumed
};

/// Jobs to delete, in this order: those too old, then, until the rest fits, those that ended first. Jobs that are not
/// removable always stay.
std::vector<std::string> jobs_to_remove(std::vector<KeptJob> jobs, const RetentionOptions& options);

}  // namespace scanrig
