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

/// A motor drive as its profile describes it. Requests that can be repeated without harm are sent up to three times.
/// Each repetition is counted in the line's statistics. Requests that start a motion are sent once.
/// Every function fails with `timeout`, `protocol`, `io` as modbus::Client does.
/// Threads: one owner.
class ModbusDrive {
 public:
  ModbusDrive(modbus::ClientOptions line, DriveProfile profile, Clock& clock)
      : line_(std::move(line), clock), profile_(std::move(profile)) {
    // An earlier program may have been killed with a trigger still set.
    if (profile_.stop.momentary) to_release_ = profile_.stop.address;
  }

  /// Reads status and position in turn. The request after a missed reply is never the same one but the other, whose
  /// reply has another length. So even a reply later than the quiet line is rejected.
  Result<DriveState> read_state(Deadline deadline);
  Result<int> read_pulses_per_motor_rev(Deadline deadline);
  /// Text of the present alarm, empty when there is none.
  Result<std::string> read_alarm(Deadline deadline);

  Result<void> enable(Deadline deadline);
  /// Sets the drive's communication time-out to the profile's, or to none, and reads it back. Does nothing where the
  /// profile has none. Fails with `protocol` where the register holds anything but a time-out.
  Result<void> guard_connection(bool on, Deadline deadline);
  Result<void> stop(Deadline deadline);
  /// Sends a stop at once if the last reply was missed, where stop() would first wait for a quiet line.
  /// The caller calls stop() next.
  void stop_without_reply();
  /// Callable from any thread, see modbus::Client.
  void set_fail_fast(bool on) noexcept { line_.set_fail_fast(on); }
  /// Writes mode and speeds, as far as the drive takes them.
  Result<void> set_homing(const std::string& mode, const DriveMotion& motion, Deadline deadline);
  /// Writes limits; does nothing where the drive has no limits: the caller keeps them.
  Result<void> set_soft_limits(const MovePlanner::Counter& range, Deadline deadline);
  /// Fails with `device_alarm` when this drive needs a power cycle.
  Result<void> reset_alarm(Deadline deadline);

  Result<void> start_move(std::int32_t target, const DriveMotion& motion, Deadline deadline);
  Result<void> start_homing(Deadline deadline);
  Result<void> set_zero(Deadline deadline);
  [[nodiscard]] bool knows_zero() const { return profile_.homing.absolute; }

  /// True if the last request may have been carried out although it failed.
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
  std::optional<std::uint16_t> to_release_;  // register of a trigger that is still set
  bool is_timeout_seen_ = false;             // the register of the communication time-out was found to hold a time-out
  bool homed_ = false;                       // where the encoder stores the zero: since the last homing
};

}  // namespace scanrig
