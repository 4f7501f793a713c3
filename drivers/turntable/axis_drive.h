#pragma once

#include <cstdint>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/turntable/axis_scale.h"

namespace scanrig {

/// What a drive says about itself at one moment.
struct DriveState {
  bool fault = false;
  bool enabled = false;
  bool running = false;
  bool in_position = false;
  bool homed = false;
  bool blind = false;         ///< under way, but the drive cannot say where: the position is an old one
  std::int32_t position = 0;  ///< pulses from home: measured, or counted where the drive has no feedback
};

/// What AxisTurntable needs of a motor drive: one request each, nothing about what a move is.
/// Every function fails with `timeout`, `protocol`, `io`. Requests that may be repeated without harm are repeated, and
/// counted; those that start a motion are sent once.
/// Threads: one owner; set_fail_fast() may be called from any thread.
class AxisDrive {
 public:
  virtual ~AxisDrive() = default;

  virtual Result<DriveState> read_state(Deadline deadline) = 0;
  /// The present alarm in words, empty when there is none.
  virtual Result<std::string> read_alarm(Deadline deadline) = 0;
  /// Fails with `device_alarm` too, when only switching it off and on helps.
  virtual Result<void> reset_alarm(Deadline deadline) = 0;

  /// Before homing, the axis standing: that the device is set up as configured (else `protocol`), and ready for
  /// commands.
  virtual Result<void> check(Deadline deadline) = 0;
  virtual Result<void> enable(Deadline deadline) = 0;
  virtual Result<void> prepare_homing(Deadline deadline) = 0;
  virtual Result<void> start_homing(Deadline deadline) = 0;
  /// The present position is home.
  virtual Result<void> set_zero(Deadline deadline) = 0;
  /// The encoder knows the zero: homing seeks nothing, it only goes there.
  [[nodiscard]] virtual bool knows_zero() const { return false; }
  virtual Result<void> set_soft_limits(const MovePlanner::Counter& range, Deadline deadline) = 0;

  /// Of the moves from now on. Fails with `out_of_range`.
  virtual Result<void> set_speed(DegreesPerSecond speed) = 0;
  virtual Result<void> start_move(std::int32_t target, Deadline deadline) = 0;

  /// While on, the drive stops by itself once nothing reaches it any more: before a motion on, at standstill off.
  /// Nothing where the drive has no communication time-out.
  virtual Result<void> guard_connection(bool /*on*/, Deadline /*deadline*/) { return {}; }

  virtual Result<void> stop(Deadline deadline) = 0;
  /// The same at once where the answer to the last request was missed, when stop() would first wait for a quiet line.
  /// Whoever calls it calls stop() next.
  virtual void stop_without_reply() = 0;
  /// While on, no request waits for a quiet line: it fails with `stopped` instead.
  virtual void set_fail_fast(bool on) noexcept = 0;

  /// Whether the last request may have been carried out although it failed.
  [[nodiscard]] virtual bool reply_missed() const = 0;
  virtual void count_retry() = 0;
};

}  // namespace scanrig
