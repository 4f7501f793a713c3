#pragma once

#include <string>

namespace scanrig {

/// What systemd is told of the service (sd_notify(3)): ready, that it makes progress (the watchdog), what it does, that
/// it ends. Where the daemon was not started by systemd, nobody is told.
/// Threads: one owner, whose progress it is.
class ServiceManager {
 public:
  ServiceManager() = default;
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// The owner goes round; the first time, the service is ready. `sentence`: for `systemctl status`.
  void alive(const std::string& sentence);

 private:
  bool ready_ = false;
  std::string told_;
};

}  // namespace scanrig
