#pragma once

#include <mutex>
#include <string>

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

}  // namespace scanrig
