#pragma once

#include <cstdint>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/turntable/move_planner.h"

namespace scanrig {

/// State of a drive at one moment, as the drive reports it.
struct DriveState {
  bool fault = false;
  bool enabled = false;
  bool running = false;
  bool in_position = false;
  bool homed = false;
  bool blind = false;         ///< moving, but the drive cannot report where: the position is an old one
  std::int32_t position = 0;  ///< pulses from home: measured, or counted where the drive has no feedback
};

/// Functions that AxisTurntable needs of a motor drive: one request each, without the logic of a move.
/// Every function fails with `timeout`, `protocol`, `io`. Requests that can be repeated without harm are repeated, and
/// counted. Requests that start a motion are sent once.
/// Threads: one owner; set_fail_fast() may be called from any thread.
class AxisDrive {
 public:
  virtual ~AxisDrive() = default;

  virtual Result<DriveState> read_state(Deadline deadline) = 0;
  /// Text of the present alarm, empty when there is none.
  virtual Result<std::string> read_alarm(Deadline deadline) = 0;
  /// Also fails with `device_alarm`, when only a power cycle helps.
  virtual Result<void> reset_alarm(Deadline deadline) = 0;

  /// Called before homing, with the axis stopped. Checks that the device is set up as configured (else `protocol`), and
  /// ready for commands.
  virtual Result<void> check(Deadline deadline) = 0;
  virtual Result<void> enable(Deadline deadline) = 0;
  virtual Result<void> prepare_homing(Deadline deadline) = 0;
  virtual Result<void> start_homing(Deadline deadline) = 0;
  /// Makes the present position home.
  virtual Result<void> set_zero(Deadline deadline) = 0;
  /// True if the encoder stores the zero: homing searches for nothing, it only moves there.
  [[nodiscard]] virtual bool knows_zero() const { return false; }
  virtual Result<void> set_soft_limits(const MovePlanner::Counter& range, Deadline deadline) = 0;

  /// Limits the speed of later moves. Fails with `out_of_range`.
  virtual Result<void> set_speed(DegreesPerSecond speed) = 0;
  virtual Result<void> start_move(std::int32_t target, Deadline deadline) = 0;

  /// While on, the drive stops on its own once it receives nothing more: on before a motion, off at standstill.
  /// Does nothing where the drive has no communication time-out.
  virtual Result<void> guard_connection(bool /*on*/, Deadline /*deadline*/) { return {}; }

  virtual Result<void> stop(Deadline deadline) = 0;
  /// Sends a stop at once if the last reply was missed, where stop() would first wait for a quiet line.
  /// The caller calls stop() next.
  virtual void stop_without_reply() = 0;
  /// While on, no request waits for a quiet line: it fails with `stopped` instead.
  virtual void set_fail_fast(bool on) noexcept = 0;

  /// True if the last request may have been carried out although it failed.
  [[nodiscard]] virtual bool reply_missed() const = 0;
  virtual void count_retry() = 0;
};

}  // namespace scanrig
