#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "config/rig_config.h"
#include "config/setup/session.h"
#include "core/signal_stop.h"
#include "daemon/journal/journal.h"
#include "daemon/service/run_daemon.h"
#include "daemon/service/systemd.h"

namespace scanrig {

/// Options of the daemon from a rig's configuration.
DaemonOptions options_from(const config::RigConfig& config);

/// A program that runs the daemon under a configuration file. On SIGHUP or an API request it runs it again, in the same
/// process, with the present file. The file is checked first. An unusable file or a bad time changes
/// nothing: the daemon continues as before, and reports why in log, reply and `systemctl status`.
class Service {
 public:
  /// Opens the devices and runs the daemon until it ends. The configuration outlives the call.
  using Run = std::function<Result<Ended>(const config::RigConfig&, const DaemonOptions&)>;

  /// `name`: of the program, `file` its rig.toml. Takes the sockets that systemd passes; make it before threads that
  /// read the environment.
  Service(std::string name, std::filesystem::path file, config::Cameras cameras)
      : name_(std::move(name)), file_(std::move(file)), cameras_(cameras) {}

  /// Runs until `stop`. Saves the configuration in use (rig/make_safe.h) before the daemon uses a device. Fails as
  /// read_rig_config(), `run` and save_config() do. If `run` does not reach the control loop under a changed
  /// configuration, the one before is restored. Real devices can be lent to setup meanwhile: then it runs over none.
  Result<void> run(SignalStop& stop, const Run& run);

 private:
  Result<void> run_again_and_again(const Run& run, config::RigConfig config);
  [[nodiscard]] Result<config::RigConfig> read() const { return config::read_rig_config(file_, {}, cameras_); }
  /// The daemon over no device: setup has them.
  Result<Ended> run_lent(DaemonOptions options);
  DaemonOptions options_for(const config::RigConfig& config, bool again);
  void make_setup(const config::RigConfig& config);
  void begin_setup(const std::string& who, ControlLoop::Reply reply);
  void end_setup(ControlLoop::Reply reply);
  void restart_for_setup(event::ReloadRequested::Why why, ControlLoop::Reply reply);
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
  std::shared_ptr<config::setup::Session> setup_;  ///< null: no devices to lend
  std::stop_token stop_;
  bool begun_ = false;  ///< the control loop runs; for run()'s thread
  std::mutex mutex_;    ///< guards all that follows
  ControlLoop* loop_ = nullptr;
  bool reloading_ = false;
  std::optional<config::RigConfig> next_;
  bool lends_next_ = false;
};

}  // namespace scanrig
