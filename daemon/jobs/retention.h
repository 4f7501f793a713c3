#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

/// The clocks of the machine at one moment.
struct TimeReading {
  std::chrono::system_clock::time_point wall{};
  bool is_synchronized = false;  ///< `wall` follows a time server
  std::chrono::seconds running{
      0};  ///< of the machine since it was switched on; only ever counts up until the next time
};

/// Source of time for retention. Threads: one user.
class SystemTime {
 public:
  virtual ~SystemTime() = default;
  /// May take seconds, less where `stop` is requested.
  [[nodiscard]] virtual TimeReading read(const std::stop_token& stop) const = 0;
};

/// The kernel's clocks. Synchronized means the same as in `timedatectl`, whichever program sets the time.
std::shared_ptr<const SystemTime> system_time();

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

struct RetentionOptions {
  std::optional<std::chrono::days> keep_for{};  ///< empty: for ever
  std::optional<std::uintmax_t> keep_bytes{};   ///< of all jobs together; empty: no limit
  std::shared_ptr<const SystemTime> time = system_time();
};

/// One job that has ended.
struct KeptJob {
  std::string id;
  std::chrono::seconds age{0};  ///< from RetentionLedger
  std::uint64_t number = 0;     ///< in the order of ending
  std::uintmax_t bytes = 0;
  bool is_removable = false;  ///< exported, and cannot be resumed
};

/// Jobs to delete, in this order: those too old, then, until the rest fits, those that ended first. Jobs that are not
/// removable always stay.
std::vector<std::string> jobs_to_remove(std::vector<KeptJob> jobs, const RetentionOptions& options);

}  // namespace scanrig
