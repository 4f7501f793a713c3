#pragma once

#include <filesystem>
#include <optional>

#include "daemon/station/job_lifecycle.h"

struct sqlite3;

namespace scanrig {

/// index.sqlite beside the job folders: what the folders of ended jobs said when they were last read, so that a start
/// with thousands of jobs does not open thousands of manifests. It may be deleted or damaged at any time: what it does
/// not know, or what is older than the folder's files, is read from the folder. Whatever SQLite refuses, the daemon
/// works without an index. Others may read it: table `jobs` (id, state, part, recipe, stamp, info).
/// Threads: one user.
class JobIndex {
 public:
  /// A file that is no sound index is replaced by an empty one.
  explicit JobIndex(std::filesystem::path file);
  ~JobIndex();
  JobIndex(const JobIndex&) = delete;
  JobIndex& operator=(const JobIndex&) = delete;

  /// What is known of the job in this folder, if its files have not changed since.
  [[nodiscard]] std::optional<JobInfo> find(const std::filesystem::path& job_folder) const;

  /// From now on the index knows these jobs and no others.
  void replace(const JobTable& jobs);

 private:
  bool open();
  void close();

  std::filesystem::path file_;
  sqlite3* database_ = nullptr;  ///< null: without an index
};

}  // namespace scanrig
