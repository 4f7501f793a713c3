#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace scanrig {

struct SleepInhibitorOptions {
  std::string who = "scanrigd";
  std::string why = "A scan is under way.";
  std::chrono::milliseconds reply_timeout{2000};
};

/// Keeps this machine awake while a job is under way: an inhibitor lock of logind [org.freedesktop.login1, Inhibit],
/// held as an open descriptor. Where logind is absent or refuses, nothing is held and one message is passed on.
/// Threads: keep_awake() from any; it never waits. Calls of logind are made by a thread of this class.
class SleepInhibitor {
 public:
  /// `report`: called once, from that thread, with the first failure.
  explicit SleepInhibitor(std::function<void(const std::string&)> report, SleepInhibitorOptions options = {});
  ~SleepInhibitor();
  SleepInhibitor(const SleepInhibitor&) = delete;
  SleepInhibitor& operator=(const SleepInhibitor&) = delete;

  void keep_awake(bool on);
  /// True when the last request has been done, or has failed.
  [[nodiscard]] bool is_settled() const;

 private:
  void run(const std::stop_token& stop);
  void take();
  void release();

  const std::function<void(const std::string&)> report_;
  const SleepInhibitorOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_wanted_ = false;   // guarded by mutex_
  bool is_applied_ = false;  // guarded by mutex_
  bool is_reported_ = false;
  int lock_ = -1;  // the descriptor that logind watches
  std::jthread thread_;
};

}  // namespace scanrig
