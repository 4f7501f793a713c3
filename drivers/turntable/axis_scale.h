#pragma once

#include <cstdint>

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

}  // namespace scanrig
