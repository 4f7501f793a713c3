#include "daemon/jobs/housekeeping_thread.h"

#include <sys/stat.h>

#include <algorithm>
#include <system_error>
#include <tuple>
#include <utility>

#include "core/catch_exceptions.h"
#include "core/priority.h"
#include "daemon/jobs/bundle.h"
#include "daemon/runtime/actor.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

fs::path ledger_file(const JobStore& store) { return store.options().root / "retention.json"; }

/// Differs after the job has ended again.
std::string end_mark(const fs::path& folder) {
  std::string mark;
  for (const auto& file : {folder / "scan.json", report_file(folder)}) {
    struct stat info {};
    if (::stat(file.c_str(), &info) != 0) info = {};
    mark += fmt::format("{}.{}.{}.{};", info.st_ino, info.st_size, info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
  }
  return mark;
}

}  // namespace

HousekeepingThread::HousekeepingThread(Clock& clock, const JobStore& store, RetentionOptions retention,
                                       std::function<JobTable()> jobs, std::function<void(Event)> post_event,
                                       BundleOptions bundle)
    : store_(store),
      retention_(std::move(retention)),
      jobs_(std::move(jobs)),
      post_event_(std::move(post_event)),
      bundle_(std::move(bundle)),
      inbox_(clock),
      thread_(start_actor(clock, [this] { run(); })) {}

HousekeepingThread::~HousekeepingThread() {
  stop_.request_stop();
  inbox_.close();
  thread_.join();
}

void HousekeepingThread::run() {
  lower_priority();
  while (auto message = inbox_.take()) {
    if (stop_.stop_requested()) continue;
    std::visit([this](const auto& m) { handle(m); }, *message);
  }
}

void HousekeepingThread::handle(const event::JobRequested& asked) {
  post_event_(event::RequestDone{asked.request_id, catch_exceptions("housekeeping", [&] { return keep(asked); })});
}

/// Empty where the station does not list it.
std::optional<JobState> HousekeepingThread::state_of(const std::string& job) const {
  const auto jobs = jobs_();
  const auto known = jobs.find(job);
  return known == jobs.end() ? std::nullopt : std::optional(known->second->state);
}

Result<std::string> HousekeepingThread::keep(const event::JobRequested& asked) {
  if (asked.what == event::JobRequested::What::bundle) {
    // A folder that cannot be read is what a person wants to see.
    const auto job = store_.read(asked.job);
    if (!job && job.error().code == ErrorCode::not_found) return fail(ErrorCode::not_found, "no job {}", asked.job);
    if (auto packed = bundle(store_.folder(asked.job), asked.path, bundle_, {stop_.get_token(), {}}); !packed) {
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

/// A failure is tried again at the next sweep.
void HousekeepingThread::handle(const Sweep&) {
  if (!retention_.keep_for && !retention_.keep_bytes) return;
  std::ignore = catch_exceptions("retention", [this] { return sweep_now(); });
}

Result<void> HousekeepingThread::sweep_now() {
  if (!ledger_) ledger_ = RetentionLedger::read(ledger_file(store_));
  ledger_->advance(retention_.time->read(stop_.get_token()));
  auto kept = ended_jobs();
  // If the disk refuses it, the time is counted again after the next start: jobs stay longer.
  std::ignore = ledger_->write(ledger_file(store_));
  for (const auto& job : jobs_to_remove(std::move(kept), retention_)) {
    const auto state = state_of(job);  // measuring takes time, in which a job may have been reprocessed
    if (state && is_final(*state)) std::ignore = remove(job);
  }
  return {};
}

/// Unreadable jobs are left for a person. Both the station and the folder must have it ended and exported.
std::vector<KeptJob> HousekeepingThread::ended_jobs() {
  std::vector<KeptJob> kept;
  std::set<std::string> ids;
  for (const auto& [id, job] : jobs_()) {
    if (!is_final(job->state)) continue;
    const auto folder = store_.folder(id);
    const auto& entry = ledger_->note(id, end_mark(folder));
    ids.insert(id);
    const auto stored = store_.read(id);
    if (!stored) continue;
    kept.push_back({.id = id,
                    .age = ledger_->age(entry),
                    .number = entry.number,
                    .bytes = retention_.keep_bytes ? measure_folder(folder).bytes : 0,
                    .is_removable = is_final(stored->state) && stored->exported && job->exported &&
                                    !is_resumable(*stored) && !is_resumable(*job)});
  }
  ledger_->keep_only(ids);
  return kept;
}

}  // namespace scanrig
