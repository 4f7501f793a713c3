#include "daemon/jobs/retention.h"

#include <algorithm>
#include <tuple>

namespace scanrig {

std::vector<std::string> jobs_to_remove(std::vector<KeptJob> jobs, const RetentionOptions& options) {
  const auto is_too_old = [&](const KeptJob& job) { return options.keep_for && job.age > *options.keep_for; };
  std::ranges::sort(jobs, {}, [&](const KeptJob& job) { return std::tuple(!is_too_old(job), job.number, job.id); });
  std::uintmax_t total = 0;
  for (const auto& job : jobs) total += job.bytes;
  std::vector<std::string> gone;
  for (const auto& job : jobs) {
    const bool is_too_much = options.keep_bytes && total > *options.keep_bytes;
    if (!job.is_removable || (!is_too_old(job) && !is_too_much)) continue;
    gone.push_back(job.id);
    total -= job.bytes;
  }
  return gone;
}

}  // namespace scanrig
