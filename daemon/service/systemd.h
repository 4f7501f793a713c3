#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace scanrig {

/// Reports to systemd on the service (sd_notify(3)): ready, progress (the watchdog), its activity, a reload of the
/// configuration, its end. Without systemd as the parent of the daemon, nothing is reported.
/// Threads: any.
class ServiceManager {
 public:
  ServiceManager() = default;
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// The control loop runs; the first time, the service is ready. `sentence`: for `systemctl status`.
  void alive(const std::string& sentence);
  /// The configuration is being read again: not ready until it stays(), or the daemon has restarted.
  void reloading();
  /// The daemon continues as before; `sentence` gives the reason.
  void stays(const std::string& sentence);
  /// Another daemon starts in this process: ready when its loop runs.
  void begins_again();

 private:
  std::mutex mutex_;
  enum class State { starting, ready, reloading } state_ = State::starting;
  bool ever_ready_ = false;
  std::string told_;
};

/// Listening sockets that systemd has opened before the daemon (sd_listen_fds(3)), by the name `api` of the socket
/// unit. They live as long as the process: a client that connects during a restart waits and gets its reply.
struct PassedSockets {
  std::optional<int> local{};  ///< Unix socket
  std::optional<int> tcp{};

  [[nodiscard]] bool any() const { return local || tcp; }
};

/// Call once, before any other thread: it takes the variables out of the environment. Closes sockets that are of no
/// use here.
PassedSockets take_passed_sockets();

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
