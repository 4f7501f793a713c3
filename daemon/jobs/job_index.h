#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/station/job_info.h"
#include "daemon/station/job_lifecycle.h"

struct sqlite3;

namespace scanrig {

/// A job as one line of JSON, for the index. Nothing else reads it, so it has no version and changes freely.
std::string to_record(const JobInfo& job);
/// False when the text is not what to_record() writes today.
bool from_record(const std::string& text, JobInfo& job);

/// index.sqlite beside the job folders: the content of ended jobs' folders when they were last read. With it, a start
/// with thousands of jobs does not open thousands of manifests. It may be deleted or damaged at any time: jobs that
/// are missing, or older than the folder's files, are read from the folder. If SQLite refuses, the daemon
/// works without an index. Others may read it: table `jobs` (id, state, part, recipe, stamp, info).
/// Threads: one user.
class JobIndex {
 public:
  /// Replaces a file that is not a sound index by an empty one.
  explicit JobIndex(std::filesystem::path file);
  ~JobIndex();
  JobIndex(const JobIndex&) = delete;
  JobIndex& operator=(const JobIndex&) = delete;

  /// Record of the job in this folder, if its files have not changed since.
  [[nodiscard]] std::optional<JobInfo> find(const std::filesystem::path& job_folder) const;

  /// Replaces the jobs of the index by these.
  void replace(const JobTable& jobs);

 private:
  bool open();
  void close();

  std::filesystem::path file_;
  sqlite3* database_ = nullptr;  ///< null: without an index
};

}  // namespace scanrig
