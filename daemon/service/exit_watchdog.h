#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/result.h"

namespace scanrig {

/// Checks that the daemon's shutdown completes: threads that wait for a disk or a panel cannot be stopped.
/// On the real clock: a virtual one runs away when the threads that hold it have ended.
/// Make it before those threads and destroy it after them.
class ExitWatchdog {
 public:
  ExitWatchdog(std::chrono::nanoseconds limit, std::function<void(const Error&)> hangs)
      : limit_(limit), hangs_(std::move(hangs)) {}
  ExitWatchdog(const ExitWatchdog&) = delete;
  ExitWatchdog& operator=(const ExitWatchdog&) = delete;
  ~ExitWatchdog() {
    {
      const std::lock_guard guard(mutex_);
      over_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  /// Starts the count. `lost`: why shutdown cannot complete; then there is no wait.
  void begin(const std::optional<Error>& lost) {
    if (lost) return hangs_(*lost);
    thread_ = std::thread([this] {
      std::unique_lock lock(mutex_);
      if (changed_.wait_for(lock, limit_, [this] { return over_; })) return;
      lock.unlock();
      hangs_({ErrorCode::timeout, "shutdown blocked by the job disk, the panel or a reconstruction"});
    });
  }

 private:
  const std::chrono::nanoseconds limit_;
  const std::function<void(const Error&)> hangs_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace scanrig
