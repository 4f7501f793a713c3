#pragma once

#include <atomic>
#include <filesystem>
#include <functional>

#include "config/rig_config.h"
#include "core/clock.h"
#include "core/result.h"
#include "drivers/turntable/modbus_drive.h"
#include "drivers/turntable/turntable.h"

namespace scanrig::ctl {

/// Motions of a program without the daemon, under the daemon's rules: see with_motion().
/// Threads: the one that called with_motion().
class Motion {
 public:
  virtual ~Motion() = default;

  /// Runs `move` on the table, the first time after 2 s of warning lamp. A pressed e-stop or Stop button, an opened
  /// guard, a panel without reply and a signal stop the table. Fails with `refused` or `stopped` (what happened and
  /// what to do), as the panel does, or as `move`.
  virtual Result<void> turn(const std::function<Result<void>(Turntable&)>& move) = 0;

  /// The same for a Modbus drive itself. `move` returns soon after `is_stop_requested`; the drive is commanded to stop
  /// after any failure.
  using DriveMove = std::function<Result<void>(ModbusDrive&, const std::atomic<bool>& is_stop_requested)>;
  virtual Result<void> turn_drive(const DriveMove& move) = 0;
};

/// The only way for a tool to move the rig `config`, read from `file`. Starts a guardian process, opens the panel,
/// refuses while e-stop or guard are open or not readable, and runs `moves`. Success requires a confirmed
/// standstill after it. SIGINT, SIGTERM and SIGHUP stop the table; at any other end of the program the guardian stops
/// it. Fails with `refused`, `stopped`, `timeout` (the table may be moving), as the panel or as `moves`.
Result<void> with_motion(const config::RigConfig& config, const std::filesystem::path& file, Clock& clock,
                         const std::function<Result<void>(Motion&)>& moves);

}  // namespace scanrig::ctl
