#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "core/result.h"
#include "daemon/jobs/system_time.h"

namespace scanrig {

/// Ages of ended jobs, counted so that no wrong clock can make a job look older than it is.
/// - The machine's running time counts always.
/// - Time while it was off, or without a count, is the difference of two wall clock readings. It counts only where
///   both clocks were synchronized and the difference is plausible (`kMaxPause`).
/// - A job's age counts from the first reading that had it ended. Times in its folder are compared with nothing.
/// A doubtful time counts as none: the job stays longer. Kept in one file beside the jobs; without the file
/// all jobs count from now.
class RetentionLedger {
 public:
  static constexpr std::chrono::seconds kMaxPause = std::chrono::days(31);

  struct Entry {
    std::string mark;               ///< a different one means that the job has ended again
    std::chrono::seconds since{0};  ///< start of the count
    std::uint64_t number = 0;       ///< in the order of ending
  };

  /// A missing or damaged file is an empty ledger.
  static RetentionLedger read(const std::filesystem::path& file);
  /// Durable. Fails with `io`.
  [[nodiscard]] Result<void> write(const std::filesystem::path& file) const;

  /// Counts the time since the last reading.
  void advance(const TimeReading& now);
  /// Records a job that has ended. `mark` is only compared for equality.
  const Entry& note(const std::string& id, const std::string& mark);
  void keep_only(const std::set<std::string>& ids);
  [[nodiscard]] std::chrono::seconds age(const Entry& entry) const { return count_ - entry.since; }

 private:
  std::chrono::seconds count_{0};
  std::optional<TimeReading> last_;
  bool same_process_ = false;  ///< this process made the last reading
  std::uint64_t last_number_ = 0;
  std::map<std::string, Entry> jobs_;
};

}  // namespace scanrig
