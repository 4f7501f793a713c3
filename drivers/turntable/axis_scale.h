#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/result.h"
#include "core/units.h"
#include "drivers/turntable/drive_profile.h"

namespace scanrig {

/// Gear, sign and zero of the axis: table angles to the drive's pulses and back.
struct AxisScale {
  std::int32_t pulses_per_motor_rev = 10000;
  double gear_ratio = 1.0;   ///< motor turns per table turn
  bool positive_ccw = true;  ///< positive pulses turn the table counter-clockwise seen from above
  Degrees home_offset;       ///< from the drive's home to the table's zero, counter-clockwise

  [[nodiscard]] double pulses_per_degree() const { return pulses_per_motor_rev * gear_ratio / 360.0; }
  /// Neither rounded nor limited to 32 bits.
  [[nodiscard]] double pulses(Degrees angle) const;
  [[nodiscard]] Degrees angle(double pulses) const;
  [[nodiscard]] double motor_rpm(DegreesPerSecond speed) const { return speed.value * gear_ratio / 6.0; }

  /// Speed and acceleration in the drive's units. Fails with `out_of_range`.
  [[nodiscard]] Result<std::uint32_t> speed_word(DegreesPerSecond speed, const DriveProfile& profile) const;
  [[nodiscard]] Result<std::uint32_t> acceleration_word(DegreesPerSecond2 acceleration,
                                                        const DriveProfile& profile) const;
};

/// Range of table angles, many turns wide or less than one.
struct AngleRange {
  Degrees min;
  Degrees max;
};

/// Targets of a move: `target`, by way of `before` if the angle must first be passed backwards.
struct MovePlan {
  std::optional<std::int32_t> before;
  std::int32_t target = 0;
};

struct MovePlanner {
  AxisScale scale;
  Degrees backlash;   ///< every angle is approached counter-clockwise over at least this much
  Degrees tolerance;  ///< a correction this small needs no new approach
  std::optional<AngleRange> soft_limits;
  /// Counter values, lowest first.
  struct Counter {
    double min;
    double max;
  };
  /// Range that the device can count.
  Counter device{std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()};

  /// The shortest way to `target`, an angle modulo 360 degrees, that stays inside the soft limits and the device's
  /// counter: near the counter's end the axis turns the other way, so it never overflows. `backlash_taken_up`: the
  /// last move ended counter-clockwise, so the backlash is taken up. Nothing when no equivalent of `target` fits.
  [[nodiscard]] std::optional<MovePlan> plan(std::int32_t from, Degrees target, bool backlash_taken_up) const;

  /// Range of counter values that may be used.
  [[nodiscard]] Counter counter_range() const;
};

}  // namespace scanrig
