#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/result.h"
#include "daemon/jobs/job_files.h"
#include "daemon/station/job_lifecycle.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

/// Whom a pair of cameras is bound to, by the makers' serial numbers; empty: not known.
struct CameraSerials {
  std::string left{}, right{};
};

struct JobStoreOptions {
  std::filesystem::path root;              ///< one folder a job
  std::filesystem::path calibration_file;  ///< copied into every job
  CameraSerials cameras{};                 ///< the rig's
  std::string profile{};                   ///< of a simulated rig; empty otherwise
  std::string config_sha256{};             ///< of the configuration that views are taken under; empty: none
  std::uintmax_t reserve_bytes = 0;        ///< of the disk: a job that would eat into it is not begun
  int bytes_per_pixel = 1;                 ///< of the sensors
};

/// The folders of all jobs. They are the truth: nothing else remembers a job.
/// Threads: every function but recover() may be called from any, for different jobs.
class JobStore {
 public:
  /// Creates the root where it is missing and keeps a second daemon out of it for as long as this object lives.
  /// Fails with `io`, `refused` (another daemon uses the root).
  static Result<JobStore> open(JobStoreOptions options);
  ~JobStore();
  JobStore(JobStore&& other) noexcept;
  JobStore& operator=(JobStore&&) = delete;

  /// What the folders say, through the index. A job that was being scanned when the daemon died is marked interrupted;
  /// what was left of folders half made or half removed goes. A folder that cannot be read is a failed job that says
  /// why. Before anything else uses the store.
  Result<JobTable> recover() const;

  /// What one folder says. Fails with `not_found`, `invalid_input`, `unsupported`.
  [[nodiscard]] Result<JobInfo> read(const std::string& id) const;

  /// A queued job. The folder appears under its name when it is whole and durable.
  /// Fails with `exists`, `io`, `not_found` and `invalid_input` (the calibration).
  [[nodiscard]] Result<JobInfo> create(const std::string& id, const JobFile& job) const;

  /// Whether the rig's calibration is of its cameras; a serial number that one of them lacks is not compared.
  /// Fails with `refused`, naming both, and as read_calibration().
  [[nodiscard]] Result<void> check_rig_cameras() const;

  /// The same of the calibration that this job's views are taken with. Fails as read() too.
  [[nodiscard]] Result<void> check_job_cameras(const std::string& id) const;

  /// Gives a job that has no views yet the rig's calibration as it is now. Fails as create().
  [[nodiscard]] Result<void> renew_calibration(const JobInfo& job) const;

  /// Whether the views still to be taken and the model fit on the disk. Fails with `io`, saying how much is missing.
  [[nodiscard]] Result<void> check_room(const JobInfo& job) const;

  /// The folder is gone at once, its files soon. Fails with `not_found`, `io`.
  [[nodiscard]] Result<void> remove(const std::string& id) const;

  [[nodiscard]] std::filesystem::path folder(const std::string& id) const { return options_.root / id; }
  [[nodiscard]] const JobStoreOptions& options() const { return options_; }

 private:
  /// Puts a folder with this manifest, order and the rig's calibration in the place of the job's.
  [[nodiscard]] Result<void> make(Manifest manifest, const JobFile& job) const;

  JobStore(JobStoreOptions options, int lock) : options_(std::move(options)), lock_(lock) {}
  JobStoreOptions options_;
  int lock_;  ///< descriptor of the locked root, -1 when moved from
};

}  // namespace scanrig
