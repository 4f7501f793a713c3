#include "daemon/jobs/retention.h"

#include <algorithm>
#include <tuple>

namespace scanrig {

std::vector<std::string> jobs_to_remove(std::vector<KeptJob> jobs, const RetentionOptions& options,
                                        std::chrono::system_clock::time_point now) {
  std::ranges::sort(jobs, {}, [](const KeptJob& job) { return job.ended; });
  const auto newest = std::ranges::find(jobs.rbegin(), jobs.rend(), false, &KeptJob::exported);
  std::uintmax_t total = 0;
  for (const auto& job : jobs) total += job.bytes;
  if (newest != jobs.rend()) jobs.erase(std::next(newest).base());

  const auto too_old = [&](const KeptJob& job) { return options.keep_for && now - job.ended > *options.keep_for; };
  std::ranges::stable_sort(jobs, {}, [&](const KeptJob& job) { return std::tuple(!too_old(job), !job.exported); });
  std::vector<std::string> gone;
  for (const auto& job : jobs) {
    const bool too_much = options.keep_bytes && total > *options.keep_bytes;
    if (!too_old(job) && !too_much) break;
    gone.push_back(job.id);
    total -= job.bytes;
  }
  return gone;
}

}  // namespace scanrig
