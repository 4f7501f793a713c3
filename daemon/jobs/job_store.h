#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"
#include "daemon/station/job_table.h"
#include "pipeline/scan/scan_folder.h"

namespace scanrig {

struct JobStoreOptions {
  std::filesystem::path root;              ///< one folder a job
  std::filesystem::path calibration_file;  ///< copied into every job
  std::string profile;                     ///< of a simulated rig; empty otherwise
  int poses = 2;
  int views = 8;
};

/// The folders of all jobs. They are the truth: nothing else remembers a job.
/// Threads: one user at a time.
class JobStore {
 public:
  /// Creates the root where it is missing and keeps a second daemon out of it for as long as this object lives.
  /// Fails with `io`, `refused` (another daemon uses the root).
  static Result<JobStore> open(JobStoreOptions options);
  ~JobStore();
  JobStore(JobStore&& other) noexcept;
  JobStore& operator=(JobStore&&) = delete;

  /// What the folders say. A job that was being scanned when the daemon died is marked interrupted.
  /// A folder that cannot be read is a failed job that says why.
  Result<JobTable> recover() const;

  /// Fails with `exists`, `io`, `not_found` and `invalid_input` (the calibration).
  Result<ScanFolder> create(const std::string& id) const;

  [[nodiscard]] const JobStoreOptions& options() const { return options_; }

 private:
  JobStore(JobStoreOptions options, int lock) : options_(std::move(options)), lock_(lock) {}
  JobStoreOptions options_;
  int lock_;  ///< descriptor of the locked root, -1 when moved from
};

/// Where a job's model and report are, and where it is noted that there is none.
std::filesystem::path model_folder(const std::filesystem::path& job_folder);
std::filesystem::path model_file(const std::filesystem::path& job_folder);
std::filesystem::path report_file(const std::filesystem::path& job_folder);

/// Notes durably that the reconstruction failed: failure.json beside scan.json. Fails with `io`.
Result<void> write_failure(const std::filesystem::path& job_folder, const Error& error);
/// Of an earlier run; nothing where there is no such file.
std::optional<Error> read_failure(const std::filesystem::path& job_folder);

}  // namespace scanrig
