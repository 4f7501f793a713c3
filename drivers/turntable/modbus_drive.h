#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/modbus/client.h"
#include "drivers/turntable/axis_drive.h"
#include "drivers/turntable/drive_profile.h"

namespace scanrig {

/// The values of a motion in the drive's own units.
struct DriveMotion {
  std::uint32_t speed = 0;
  std::uint32_t acceleration = 0;
  std::uint32_t deceleration = 0;
  std::uint32_t slow_speed = 0;  ///< of homing, for the last approach of the switch
};

/// A motor drive as its profile describes it. Requests that may be repeated without harm are sent up to three times,
/// each repetition counted in the line's statistics; those that start a motion are sent once.
/// Every function fails with `timeout`, `protocol`, `io` as modbus::Client does.
/// Threads: one owner.
class ModbusDrive {
 public:
  ModbusDrive(modbus::ClientOptions line, DriveProfile profile, Clock& clock)
      : line_(std::move(line), clock), profile_(std::move(profile)) {
    // Whoever was here before may have been killed with an input pulled.
    if (profile_.stop.momentary) to_release_ = profile_.stop.address;
  }

  /// Status and position, read in turn. What follows a missed answer is never the same request again but the other
  /// one, whose answer has another length: even an answer later than the quiet line is refused, not believed.
  Result<DriveState> read_state(Deadline deadline);
  Result<int> read_pulses_per_motor_rev(Deadline deadline);
  /// The present alarm in words, empty when there is none.
  Result<std::string> read_alarm(Deadline deadline);

  Result<void> enable(Deadline deadline);
  /// Sets the drive's communication time-out as the profile has it, or to none, and reads it back. Nothing where the
  /// profile has none. Fails with `protocol` where the register holds something else than a time-out.
  Result<void> guard_connection(bool on, Deadline deadline);
  Result<void> stop(Deadline deadline);
  /// The same at once where the answer to the last request was missed, when stop() would first wait for a quiet line.
  /// Whoever calls it calls stop() next.
  void stop_without_reply();
  /// From any thread, see modbus::Client.
  void set_fail_fast(bool on) noexcept { line_.set_fail_fast(on); }
  /// Mode and speeds, as far as the drive wants to be told.
  Result<void> set_homing(const std::string& mode, const DriveMotion& motion, Deadline deadline);
  /// Nothing where the drive has none: the caller keeps them.
  Result<void> set_soft_limits(const MovePlanner::Counter& range, Deadline deadline);
  /// Fails with `device_alarm` when this drive wants a power cycle.
  Result<void> reset_alarm(Deadline deadline);

  Result<void> start_move(std::int32_t target, const DriveMotion& motion, Deadline deadline);
  Result<void> start_homing(Deadline deadline);
  Result<void> set_zero(Deadline deadline);
  [[nodiscard]] bool knows_zero() const { return profile_.homing.absolute; }

  /// Whether the last request may have been carried out although it failed.
  [[nodiscard]] bool reply_missed() const { return line_.reply_missed(); }
  void count_retry() { line_.count_retry(); }
  [[nodiscard]] const modbus::ClientStatistics& statistics() const { return line_.statistics(); }

 private:
  Result<void> write(const DriveProfile::Trigger& trigger, Deadline deadline);
  Result<void> write(const DriveProfile::Block& block, std::int32_t target, const DriveMotion& motion,
                     Deadline deadline);
  Result<void> pull(const DriveProfile::Trigger& trigger, Deadline deadline);
  Result<void> release(Deadline deadline);
  Result<std::uint16_t> read_communication_timeout(Deadline deadline);
  template <class Request>
  auto repeat(const Request& request) -> decltype(request());

  modbus::Client line_;
  DriveProfile profile_;
  std::optional<std::uint16_t> to_release_;  // the register of a trigger that is still pulled
  bool is_timeout_seen_ = false;             // the register of the communication time-out was found to hold one
  bool homed_ = false;                       // where the encoder knows the zero: since the last homing
};

}  // namespace scanrig
