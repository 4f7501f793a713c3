#pragma once

#include <mutex>
#include <string>

namespace scanrig {

/// What systemd is told of the service (sd_notify(3)): ready, that it makes progress (the watchdog), what it does, that
/// it reads its configuration again, that it ends. Where the daemon was not started by systemd, nobody is told.
/// Threads: any.
class ServiceManager {
 public:
  ServiceManager() = default;
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// The control loop goes round; the first time, the service is ready. `sentence`: for `systemctl status`.
  void alive(const std::string& sentence);
  /// The configuration is being read again: not ready until it stays(), or the daemon has begun again.
  void reloading();
  /// The daemon goes on as it was; `sentence` says why.
  void stays(const std::string& sentence);
  /// Another daemon begins in this process: ready when it goes round.
  void begins_again();

 private:
  std::mutex mutex_;
  enum class State { starting, ready, reloading } state_ = State::starting;
  bool ever_ready_ = false;
  std::string told_;
};

}  // namespace scanrig
