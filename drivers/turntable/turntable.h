#pragma once

#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "core/units.h"

namespace scanrig {

/// What is known about the axis, from the device itself.
struct TurntableStatus {
  enum class Motion { stopped, moving, unknown };
  Motion motion = Motion::unknown;  ///< `unknown`: the drive cannot be reached, the table may be moving
  bool homed = false;
  std::optional<Degrees> angle;  ///< as the device says: measured, or its steps counted where it has no feedback
  std::string alarm;             ///< in words; empty when there is none
};

/// How a move went, for the job's evidence.
struct Move {
  Degrees commanded;
  Degrees measured;
  Clock::Duration moving{};    ///< command to in-position
  Clock::Duration settling{};  ///< in-position to still
};

/// The rotary axis that carries the object.
/// Angles are absolute, from home, positive counter-clockwise seen from above.
/// Threads: one owner; only request_stop() may be called from another.
class Turntable {
 public:
  virtual ~Turntable() = default;

  /// Finds home. Until this has succeeded, and again after every failure, rotate_to() fails with `not_homed`.
  /// Fails with `timeout`, `device_alarm`, `stalled`, `stopped`, `protocol`, `io`.
  virtual Result<void> home(Deadline deadline) = 0;

  /// Turns to `target`, returns how it went once the axis is seen still.
  /// Fails with `not_homed`, `out_of_range` (nothing was sent), `timeout` (not settled by `deadline`), `stalled` (no
  /// progress for 2 s), `device_alarm`, `stopped`, `protocol`, `io`. After any failure the motor has been told to stop.
  virtual Result<Move> rotate_to(Degrees target, Deadline deadline) = 0;

  /// Stops and returns once the axis is seen standing. Fails with `timeout`, `protocol`, `io`: it may be moving.
  virtual Result<void> stop(Deadline deadline) = 0;

  /// Clears a device alarm. Fails with `device_alarm` (it stays, or wants a power cycle), `timeout`, `protocol`, `io`.
  virtual Result<void> reset_alarm(Deadline deadline) = 0;

  /// Asks the device. Fails with `timeout`, `protocol`, `io`.
  virtual Result<TurntableStatus> status(Deadline deadline) = 0;

  /// Moves from now on are no faster than `limit`, and than configured; nothing: as configured.
  /// Fails with `unsupported`, `out_of_range`.
  virtual Result<void> limit_speed(std::optional<DegreesPerSecond> /*limit*/) {
    return fail(ErrorCode::unsupported, "turntable: this drive's speed cannot be limited");
  }

  /// Ends one call with `stopped`, and stops the motor: the home() or rotate_to() that runs, or where none runs, the
  /// next one, before it moves anything. With that the request is delivered: the home() after it is a new decision.
  virtual void request_stop() noexcept = 0;
};

}  // namespace scanrig
