#pragma once

#include <chrono>
#include <filesystem>

#include "config/rig_config.h"
#include "core/clock.h"

namespace scanrig {

/// What is known of the devices that have to be made safe, each by itself: see config::read_device_config().
struct DeviceConfigs {
  Result<config::RigConfig> turntable, projector, panel;
};

/// What could be reached when the rig was made safe.
struct MadeSafe {
  Result<void> turntable;  ///< seen standing; otherwise the table may be moving
  Result<void> projector;  ///< told to be dark
  Result<void> panel;      ///< shows red
};

/// Stop, light off, red lamp, all at once and each again and again until it has succeeded or `deadline` has passed: the
/// daemon that had the devices may have died a moment ago. A device whose configuration cannot be used leaves the
/// others to be made safe. May be done twice.
MadeSafe make_safe(const DeviceConfigs& config, Clock& clock, Deadline deadline);

/// Who else may have the turntable's port: nobody, or a daemon that hangs and started this process.
enum class Beside { nobody, hung_daemon };

/// For systemd's ExecStopPost=: within a second, with a line on standard error for what was not reached. Uses what the
/// last daemon of `file` has kept (saved_config.h), and for what that does not tell `file` as it is now.
/// `ok`, `device` (the table may be moving), `partly_safe` (it stands, but light or lamp were not reached),
/// `bad_input` (nothing of the configuration can be used).
ExitCode make_safe_now(const std::filesystem::path& file, const char* program, Beside beside = Beside::nobody);

/// `program --make-safe --beside-daemon --config FILE` as a process of its own: the way to the drive for a daemon whose
/// turntable hangs. Returns once the table is seen standing. Fails with `io` (cannot be started), `timeout` (killed
/// after `limit`), `device_alarm` (the table may be moving).
Result<void> make_safe_in_process(const std::filesystem::path& program, const std::filesystem::path& file,
                                  std::chrono::milliseconds limit = std::chrono::milliseconds(1500));

}  // namespace scanrig
