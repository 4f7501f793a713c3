#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "core/result.h"
#include "daemon/station/transition.h"

namespace scanrig {

/// One moment by two clocks: the wall clock may jump, the other one restarts with the machine.
struct Moment {
  std::string boot_id;          ///< /proc/sys/kernel/random/boot_id
  std::chrono::seconds boot{};  ///< since the machine started, suspended time included
  std::chrono::seconds wall{};  ///< since 1970
};
Moment moment_now();

/// Records that outlive the process, in the state folder: the latch (latch.json), and how often the service ended
/// unexpectedly (run.json). Every change is durable when its call returns.
/// Threads: one user at a time.
class SafetyRecord {
 public:
  static constexpr int kUnexpectedEnds = 3;
  static constexpr std::chrono::minutes kWithin{5};

  explicit SafetyRecord(std::filesystem::path folder, std::function<Moment()> now = moment_now)
      : folder_(std::move(folder)), now_(std::move(now)) {}

  /// Records that the service runs, and returns the latch of the last process. kUnexpectedEnds within kWithin are
  /// a latch too. So is an unreadable record: whatever it held, a person has to check first.
  /// Fails with `io`.
  Result<std::optional<Latch>> begin();
  /// Records a clean end: the unexpected ones before it count no more. Fails with `io`.
  Result<void> end();
  /// Stores the latch; nothing: it is cleared. Fails with `io`.
  Result<void> store_latch(const std::optional<Latch>& latch);

 private:
  [[nodiscard]] std::optional<Latch> read_latch() const;
  /// The ends so far, including the one that this start proves.
  [[nodiscard]] Result<std::vector<Moment>> unexpected_ends() const;
  Result<void> write_run(bool running, const std::vector<Moment>& ends);

  const std::filesystem::path folder_;
  const std::function<Moment()> now_;
};

/// Writes latches on a separate thread: a disk that hangs holds its caller for kMaxWait and no longer.
/// Threads: store() from one thread.
class LatchWriter {
 public:
  static constexpr std::chrono::milliseconds kMaxWait{300};

  explicit LatchWriter(SafetyRecord& record);
  ~LatchWriter();
  LatchWriter(const LatchWriter&) = delete;
  LatchWriter& operator=(const LatchWriter&) = delete;

  /// Returns once `latch` is durable. Fails with `timeout` where that takes longer than kMaxWait (writing continues)
  /// and as SafetyRecord::store_latch.
  Result<void> store(std::optional<Latch> latch);

 private:
  void run();

  SafetyRecord& record_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::optional<Latch>> wanted_;  // guarded by mutex_, as all below; nothing: all is written
  Result<void> done_{};
  bool writing_ = false;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace scanrig
