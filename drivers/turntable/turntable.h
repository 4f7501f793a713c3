#pragma once

#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "core/units.h"

namespace scanrig {

/// State of the axis, as the device reports it.
struct TurntableStatus {
  enum class Motion { stopped, moving, unknown };
  Motion motion = Motion::unknown;  ///< `unknown`: the drive cannot be reached, the table may be moving
  bool homed = false;
  std::optional<Degrees> angle;  ///< as the device reports: measured, or its steps counted where it has no feedback
  std::string alarm;             ///< text of the alarm; empty when there is none
};

/// Result of a move, for the job's evidence.
struct Move {
  Degrees commanded;
  Degrees measured;
  Clock::Duration moving{};    ///< command to in-position
  Clock::Duration settling{};  ///< in-position to stopped
};

/// The rotary axis that carries the object.
/// Angles are absolute, from home, positive counter-clockwise seen from above.
/// Threads: one owner; only request_stop() may be called from any other thread.
class Turntable {
 public:
  virtual ~Turntable() = default;

  /// Finds home. rotate_to() fails with `not_homed` until this has succeeded, and again after every failure.
  /// Fails with `timeout`, `device_alarm`, `stalled`, `stopped`, `protocol`, `io`.
  virtual Result<void> home(Deadline deadline) = 0;

  /// Turns to `target`, returns the result once the axis has stopped.
  /// Fails with `not_homed`, `out_of_range` (nothing was sent), `timeout` (not settled by `deadline`), `stalled` (no
  /// progress for 2 s), `device_alarm`, `stopped`, `protocol`, `io`. After any failure the motor has been sent a stop.
  virtual Result<Move> rotate_to(Degrees target, Deadline deadline) = 0;

  /// Stops and returns once the axis is seen stopped. Fails with `timeout`, `protocol`, `io`: it may be moving.
  virtual Result<void> stop(Deadline deadline) = 0;

  /// Clears a device alarm. Fails with `device_alarm` (it stays, or needs a power cycle), `timeout`, `protocol`, `io`.
  virtual Result<void> reset_alarm(Deadline deadline) = 0;

  /// Reads the device. Fails with `timeout`, `protocol`, `io`.
  virtual Result<TurntableStatus> status(Deadline deadline) = 0;

  /// Limits later moves to `limit`, and to the configured speed; nothing: only to the configured speed.
  /// Fails with `unsupported`, `out_of_range`.
  virtual Result<void> limit_speed(std::optional<DegreesPerSecond> /*limit*/) {
    return fail(ErrorCode::unsupported, "turntable: this drive's speed cannot be limited");
  }

  /// Ends one call with `stopped`, and stops the motor: the running home() or rotate_to(), or if none is running, the
  /// next one, before it moves anything. With that the request is delivered: the home() after it is a new decision.
  virtual void request_stop() noexcept = 0;

  /// Lets a requested stop that found nothing running end no later call: it was delivered by stop(), and whatever is
  /// called from now on was asked for after it. For the owner.
  virtual void drop_stop_request() noexcept = 0;
};

}  // namespace scanrig
