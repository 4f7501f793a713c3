#include "daemon/jobs/housekeeping_thread.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <tuple>
#include <utility>

#include "daemon/jobs/bundle.h"
#include "daemon/runtime/actor_thread.h"
#include "daemon/runtime/catch_exceptions.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

std::uintmax_t bytes_in(const fs::path& folder) {
  std::uintmax_t total = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator next(folder, error), end; !error && next != end; next.increment(error)) {
    std::error_code ignored;
    const auto size = next->file_size(ignored);
    if (!ignored) total += size;
  }
  return total;
}

/// When the manifest was last written, or the report.
std::chrono::system_clock::time_point ended(const fs::path& folder) {
  std::time_t newest = 0;
  for (const auto& file : {folder / "scan.json", report_file(folder)}) {
    struct stat info {};
    if (::stat(file.c_str(), &info) == 0) newest = std::max(newest, info.st_mtim.tv_sec);
  }
  return std::chrono::system_clock::from_time_t(newest);
}

}  // namespace

HousekeepingThread::HousekeepingThread(Clock& clock, const JobStore& store, RetentionOptions retention,
                                       std::function<JobTable()> jobs, std::function<void(Event)> post_event)
    : store_(store),
      retention_(retention),
      jobs_(std::move(jobs)),
      post_event_(std::move(post_event)),
      inbox_(clock),
      thread_(start_actor(clock, [this] { run(); })) {}

HousekeepingThread::~HousekeepingThread() {
  stop_.request_stop();
  inbox_.close();
  thread_.join();
}

void HousekeepingThread::run() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 10);
  while (auto message = inbox_.take()) {
    if (stop_.stop_requested()) continue;
    std::visit([this](const auto& m) { handle(m); }, *message);
  }
}

void HousekeepingThread::handle(const event::JobRequested& asked) {
  post_event_(event::RequestDone{asked.request_id, catch_exceptions("housekeeping", [&] { return keep(asked); })});
}

/// None where the station does not know it.
std::optional<JobState> HousekeepingThread::state_of(const std::string& job) const {
  const auto jobs = jobs_();
  const auto known = jobs.find(job);
  return known == jobs.end() ? std::nullopt : std::optional(known->second->state);
}

Result<std::string> HousekeepingThread::keep(const event::JobRequested& asked) {
  if (asked.what == event::JobRequested::What::bundle) {
    // A folder that cannot be read is what somebody wants to see.
    const auto job = store_.read(asked.job);
    if (!job && job.error().code == ErrorCode::not_found) return fail(ErrorCode::not_found, "no job {}", asked.job);
    if (auto packed = bundle(store_.folder(asked.job), asked.path, {stop_.get_token(), {}}); !packed) {
      return pass_on(packed);
    }
    return asked.path;
  }
  const auto state = state_of(asked.job);
  if (state && !is_final(*state)) {
    return fail(ErrorCode::busy, "job {} is {}: only what has ended can be removed", asked.job, to_string(*state));
  }
  if (auto removed = remove(asked.job); !removed) return pass_on(removed);
  return asked.job;
}

Result<void> HousekeepingThread::remove(const std::string& job) {
  auto removed = store_.remove(job);
  if (removed) post_event_(event::JobRemoved{job});
  return removed;
}

/// What fails is tried again at the next sweep.
void HousekeepingThread::handle(const Sweep&) {
  if (!retention_.keep_for && !retention_.keep_bytes) return;
  std::ignore = catch_exceptions("retention", [this] { return sweep_now(); });
}

Result<void> HousekeepingThread::sweep_now() {
  std::vector<KeptJob> kept;
  for (const auto& [id, job] : jobs_()) {
    // What cannot be read is left for a person to see.
    if (!is_final(job->state) || !store_.read(id)) continue;
    const auto folder = store_.folder(id);
    kept.push_back({id, ended(folder), bytes_in(folder), job->exported});
  }
  for (const auto& job : jobs_to_remove(std::move(kept), retention_, std::chrono::system_clock::now())) {
    const auto state = state_of(job);  // measuring takes its time, in which a job may have been resumed
    if (state && is_final(*state)) std::ignore = remove(job);
  }
  return {};
}

}  // namespace scanrig
