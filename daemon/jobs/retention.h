#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace scanrig {

struct RetentionOptions {
  std::optional<std::chrono::days> keep_for{};  ///< empty: for ever
  std::optional<std::uintmax_t> keep_bytes{};   ///< of all jobs together; empty: as many as there are
};

/// One job that has ended.
struct KeptJob {
  std::string id;
  std::chrono::system_clock::time_point ended;
  std::uintmax_t bytes = 0;
  bool exported = false;
};

/// Which jobs go, in this order: what is too old, then, until the rest fits, exported ones before the others and older
/// ones before newer ones. The newest one that was not exported always stays: somebody may be on his way to fetch it.
std::vector<std::string> jobs_to_remove(std::vector<KeptJob> jobs, const RetentionOptions& options,
                                        std::chrono::system_clock::time_point now);

}  // namespace scanrig
