#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "config/rig_config.h"
#include "daemon/journal/journal.h"
#include "daemon/runtime/signal_stop.h"
#include "daemon/service/passed_sockets.h"
#include "daemon/service/run_daemon.h"
#include "daemon/service/service_manager.h"
#include "daemon/service/sleep_inhibitor.h"

namespace scanrig {

/// A program that runs the daemon under a configuration file, and in the same process again when SIGHUP or the API asks
/// for the file as it is now. The file is checked first, and what cannot be used or comes at a bad time changes
/// nothing: the daemon goes on as it was, and says why in log, answer and `systemctl status`.
class Service {
 public:
  /// Opens the devices and runs the daemon until it ends. The configuration outlives the call.
  using Run = std::function<Result<Ended>(const config::RigConfig&, const DaemonOptions&)>;

  /// `name`: of the program, `file` its rig.toml. Takes the sockets that systemd passes; to be made before threads that
  /// read the environment.
  Service(std::string name, std::filesystem::path file, config::Cameras cameras)
      : name_(std::move(name)), file_(std::move(file)), cameras_(cameras) {}

  /// Until `stop`. What the daemon runs under is kept (rig/saved_config.h) before it uses a device. Fails as
  /// read_rig_config(), `run` and save_config() do; a changed configuration under which `run` does not get as far as
  /// the control loop is given up for the one before.
  Result<void> run(SignalStop& stop, const Run& run);

 private:
  Result<void> run_again_and_again(const Run& run, config::RigConfig config);
  [[nodiscard]] Result<config::RigConfig> read() const { return config::read_rig_config(file_, {}, cameras_); }
  DaemonOptions options_for(const config::RigConfig& config, bool again);
  void tell_begin(const config::RigConfig& config);
  void reload(ControlLoop::Reply reply);
  void give_up(const Error& why, const ControlLoop::Reply& reply);
  void tell(Priority priority, std::string message) { journal_->write({priority, std::move(message)}); }

  const std::string name_;
  const std::filesystem::path file_;
  const config::Cameras cameras_;
  const PassedSockets sockets_ = take_passed_sockets();
  ServiceManager manager_;
  std::optional<Journal> journal_;
  std::optional<SleepInhibitor> awake_;
  bool begun_ = false;  ///< the control loop goes round; of run()'s thread
  std::mutex mutex_;    ///< of all that follows
  ControlLoop* loop_ = nullptr;
  bool reloading_ = false;
  std::optional<config::RigConfig> next_;
};

}  // namespace scanrig
