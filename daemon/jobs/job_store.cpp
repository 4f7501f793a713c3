#include "daemon/jobs/job_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "core/files.h"
#include "daemon/station/timestamp.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFailure = "failure.json";

std::vector<StoredView> stored_views(const Manifest& manifest) {
  std::vector<StoredView> views;
  for (std::size_t pose = 0; pose < manifest.poses.size(); ++pose) {
    for (const auto& view : manifest.poses[pose].views) {
      views.push_back({static_cast<int>(pose), view.index, view.measured_deg, 0, view.commanded_deg, view.settling_ms});
    }
  }
  return views;
}

/// The state of a job nobody works on, from its files; `job.error` says why where it is not done.
void settle(JobInfo& job, const std::string& manifest_state, const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(report_file(folder), ignored)) {
    job.state = JobState::done;
    job.model = model_file(folder);
    job.report = report_file(folder);
  } else if (manifest_state == "scanned") {
    job.error = read_failure(folder);
    job.state = job.error ? JobState::failed : JobState::interrupted;
    if (!job.error) {
      job.error = Error{ErrorCode::stopped, fmt::format("the daemon ended before the model was made: run scanrig "
                                                        "reconstruct {}",
                                                        folder.string())};
    }
  } else {
    job.state = parse_job_state(manifest_state).value_or(JobState::interrupted);
    job.error = read_failure(folder).value_or(Error{ErrorCode::stopped, "the scan was " + manifest_state});
  }
}

Result<JobInfo> recover_job(const fs::path& folder, const JobStoreOptions& options) {
  auto scan = ScanFolder::open(folder);
  if (!scan) return pass_on(scan);
  JobInfo job{.id = folder.filename(), .folder = folder, .poses = options.poses, .views = options.views};
  job.stored = stored_views(scan->manifest());
  const std::string state = scan->manifest().state;
  if (state == "queued" || state == "scanning" || state == "waiting_for_flip") {
    if (auto marked = scan->set_state("interrupted"); !marked) return pass_on(marked);
    job.state = JobState::interrupted;
    job.error = Error{ErrorCode::stopped, "the daemon ended during the scan"};
  } else {
    settle(job, state, folder);
  }
  return job;
}

}  // namespace

Result<JobStore> JobStore::open(JobStoreOptions options) {
  std::error_code error;
  options.root = fs::absolute(options.root, error);
  if (auto made = create_directories_synced(options.root); !made) return pass_on(made);
  const int lock = ::open(options.root.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock < 0) return fail(ErrorCode::io, "cannot open {}: {}", options.root.string(), std::strerror(errno));
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock);
    return fail(ErrorCode::refused, "{}: another daemon keeps its jobs there: stop it or name another folder",
                options.root.string());
  }
  return JobStore(std::move(options), lock);
}

JobStore::~JobStore() {
  if (lock_ >= 0) ::close(lock_);
}

JobStore::JobStore(JobStore&& other) noexcept
    : options_(std::move(other.options_)), lock_(std::exchange(other.lock_, -1)) {}

Result<JobTable> JobStore::recover() const {
  JobTable jobs;
  std::error_code error;
  for (fs::directory_iterator next(options_.root, error), end; !error && next != end; next.increment(error)) {
    std::error_code ignored;
    if (!next->is_directory(ignored)) continue;
    const fs::path folder = next->path();
    auto job = recover_job(folder, options_);
    if (!job) {
      job = JobInfo{.id = folder.filename(), .folder = folder, .state = JobState::failed, .error = job.error()};
    }
    jobs.emplace(job->id, std::make_shared<const JobInfo>(*job));
  }
  if (error) return fail(ErrorCode::io, "cannot list {}: {}", options_.root.string(), error.message());
  return jobs;
}

Result<ScanFolder> JobStore::create(const std::string& id) const {
  Manifest manifest;
  manifest.id = id;
  manifest.created = iso_time(std::chrono::system_clock::now());
  manifest.state = "scanning";
  manifest.profile = options_.profile;
  return ScanFolder::create(options_.root / id, std::move(manifest), options_.calibration_file);
}

fs::path model_folder(const fs::path& job_folder) { return job_folder / "model"; }
fs::path model_file(const fs::path& job_folder) { return model_folder(job_folder) / "model.glb"; }
fs::path report_file(const fs::path& job_folder) { return model_folder(job_folder) / "report.json"; }

Result<void> write_failure(const fs::path& job_folder, const Error& error) {
  const nlohmann::ordered_json json = {{"code", to_string(error.code)}, {"message", error.message}};
  return write_file_atomically(job_folder / kFailure,
                               json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

std::optional<Error> read_failure(const fs::path& job_folder) {
  const auto text = read_file(job_folder / kFailure);
  if (!text) return std::nullopt;
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("message") || !json["message"].is_string()) return std::nullopt;
  const auto code = json.contains("code") && json["code"].is_string()
                        ? parse_error_code(json["code"].get<std::string>())
                        : std::nullopt;
  return Error{code.value_or(ErrorCode::internal), json["message"]};
}

}  // namespace scanrig
