#pragma once

#include <chrono>
#include <filesystem>

#include "config/rig_config.h"
#include "core/clock.h"

namespace scanrig {

/// The configuration a daemon runs under, saved for the process that makes the rig safe after the daemon's death.
/// rig.toml may have been edited since, damaged or moved. `rig.toml` in this folder, its drive profile in `drives`.
/// Folder for the daemon of `file`: the one that systemd makes for the service ($RUNTIME_DIRECTORY), otherwise beside
/// `file`.
std::filesystem::path saved_config_folder(const std::filesystem::path& file);

/// Saves before a device is used. Fails with `io`; then the older saved configuration remains.
Result<void> save_config(const config::RigConfig& config, const std::filesystem::path& folder);

/// Configuration of each device to be made safe, read separately: see config::read_device_config().
struct DeviceConfigs {
  Result<config::RigConfig> turntable, projector, panel;
};

/// Devices that were reached when the rig was made safe.
struct MadeSafe {
  Result<void> turntable;  ///< standstill confirmed; otherwise the table may be moving
  Result<void> projector;  ///< commanded to be off
  Result<void> panel;      ///< shows red
};

/// Stops the table, turns the light off and the red lamp on, all at once. Each is repeated until it has succeeded or
/// `deadline` has passed: the daemon that had the devices may have died a moment ago. A device whose configuration
/// cannot be used does not keep the others from being made safe. May be called twice.
MadeSafe make_safe(const DeviceConfigs& config, Clock& clock, Deadline deadline);

/// The other user of the turntable's port: none, or a daemon that hangs and started this process.
enum class Beside { nobody, hung_daemon };

/// For systemd's ExecStopPost=: returns within a second, with a line on standard error for what was not reached. Uses
/// what the last daemon of `file` has saved (save_config()), and the present `file` for what is missing there.
/// `ok`, `device` (the table may be moving), `partly_safe` (the table is stopped, but light or lamp were not reached),
/// `bad_input` (nothing of the configuration can be used).
ExitCode make_safe_now(const std::filesystem::path& file, const char* program, Beside beside = Beside::nobody);

/// `program --make-safe --beside-daemon --config FILE` as a separate process: the way to the drive for a daemon whose
/// turntable hangs. Returns once standstill is confirmed. Fails with `io` (cannot be started), `timeout` (killed
/// after `limit`), `device_alarm` (the table may be moving).
Result<void> make_safe_in_process(const std::filesystem::path& program, const std::filesystem::path& file,
                                  std::chrono::milliseconds limit = std::chrono::milliseconds(1500));

}  // namespace scanrig
