#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/result.h"
#include "daemon/jobs/job_files.h"
#include "daemon/station/job_lifecycle.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

/// The makers' serial numbers of a pair of cameras; empty: unknown.
struct CameraSerials {
  std::string left{}, right{};
};

struct JobStoreOptions {
  std::filesystem::path root;                     ///< one folder per job
  std::filesystem::path calibration_file;         ///< copied into every job
  CameraSerials cameras{};                        ///< the rig's
  std::string profile{};                          ///< of a simulated rig; empty otherwise
  std::string config_sha256{};                    ///< of the configuration that views are taken under; empty: none
  std::uintmax_t reserve_bytes = 0;               ///< of the disk: a job that would use it does not start
  int bytes_per_pixel = 1;                        ///< of the sensors
  std::chrono::hours check_calibration_every{0};  ///< an older one is reported; 0: never
};

/// The folders of all jobs. They are the truth: a job is recorded nowhere else.
/// Threads: every function but recover() may be called from any, for different jobs.
class JobStore {
 public:
  /// Creates a missing root and keeps a second daemon out of it for as long as this object lives.
  /// Fails with `io`, `refused` (another daemon uses the root).
  static Result<JobStore> open(JobStoreOptions options);
  ~JobStore();
  JobStore(JobStore&& other) noexcept;
  JobStore& operator=(JobStore&&) = delete;

  /// Jobs as the folders record them, through the index. A job that was being scanned when the daemon died is marked
  /// interrupted; folders half made or half deleted are deleted. An unreadable folder becomes a failed job with the
  /// reason. Call before anything else uses the store.
  Result<JobTable> recover() const;

  /// Content of one folder. Fails with `not_found`, `invalid_input`, `unsupported`.
  [[nodiscard]] Result<JobInfo> read(const std::string& id) const;

  /// Creates a queued job. The folder appears under its name when it is complete and durable.
  /// Fails with `exists`, `io`, `not_found` and `invalid_input` (the calibration).
  [[nodiscard]] Result<JobInfo> create(const std::string& id, const JobFile& job) const;

  /// Checks whether the rig's calibration belongs to its cameras. A serial number missing in either is not compared.
  /// Fails with `refused`, naming both, or for a missing calibration, and as read_calibration().
  [[nodiscard]] Result<void> check_rig_cameras() const;

  /// That the rig's calibration is older than it should be, as a sentence; empty: it is not.
  [[nodiscard]] std::string calibration_reminder() const;

  /// Puts the calibration of a solved job in the place of the rig's, which is kept beside it as calibration-DATE.json.
  /// A crash leaves the old one or the new one whole. Fails with `refused` (not solved, other cameras), `io`, and as
  /// read_calibration().
  [[nodiscard]] Result<void> accept_calibration(const JobInfo& job) const;

  /// The same check for the calibration that this job's views are taken with. Fails as read() too.
  [[nodiscard]] Result<void> check_job_cameras(const std::string& id) const;

  /// Gives a job without views the rig's present calibration. Fails as create().
  [[nodiscard]] Result<void> renew_calibration(const JobInfo& job) const;

  /// Checks whether the missing views and the model fit on the disk. Fails with `io`, naming the missing space.
  [[nodiscard]] Result<void> check_room(const JobInfo& job) const;

  /// Deletes the folder: gone at once, its files soon. Fails with `not_found`, `io`.
  [[nodiscard]] Result<void> remove(const std::string& id) const;

  [[nodiscard]] std::filesystem::path folder(const std::string& id) const { return options_.root / id; }
  [[nodiscard]] const JobStoreOptions& options() const { return options_; }

 private:
  /// Replaces the job's folder by one with this manifest, order and the rig's calibration.
  [[nodiscard]] Result<void> make(Manifest manifest, const JobFile& job) const;

  JobStore(JobStoreOptions options, int lock) : options_(std::move(options)), lock_(lock) {}
  JobStoreOptions options_;
  int lock_;  ///< descriptor of the locked root, -1 when moved from
};

}  // namespace scanrig
