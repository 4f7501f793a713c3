#include "drivers/turntable/axis_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanrig {
namespace {

/// Largest value that the profile's move block can hold.
double most(DriveProfile::Block::Word word, const DriveProfile& profile) {
  return profile.move.has(word, true) ? std::numeric_limits<std::int32_t>::max()
                                      : std::numeric_limits<std::uint16_t>::max();
}

}  // namespace

double AxisScale::pulses(Degrees angle) const {
  return (positive_ccw ? 1.0 : -1.0) * (angle + home_offset).value * pulses_per_degree();
}

Degrees AxisScale::angle(double pulses) const {
  return Degrees{(positive_ccw ? 1.0 : -1.0) * pulses / pulses_per_degree()} - home_offset;
}

Result<std::uint32_t> AxisScale::speed_word(DegreesPerSecond speed, const DriveProfile& profile) const {
  const double rpm = motor_rpm(speed);
  if (!(rpm > 0.0 && rpm <= profile.max_motor_rpm)) {
    return fail(ErrorCode::out_of_range,
                "{} deg/s at the table is {:.0f} rpm at the motor, the drive allows more than 0 to {:.0f} rpm",
                speed.value, rpm, profile.max_motor_rpm);
  }
  const double word = profile.speed_unit == DriveProfile::SpeedUnit::rpm ? rpm : rpm * pulses_per_motor_rev / 60.0;
  if (word > most(DriveProfile::Block::Word::speed, profile)) {
    return fail(ErrorCode::out_of_range, "{} deg/s is more than the drive's speed word holds", speed.value);
  }
  return static_cast<std::uint32_t>(std::max(1.0, std::round(word)));
}

Result<std::uint32_t> AxisScale::acceleration_word(DegreesPerSecond2 acceleration, const DriveProfile& profile) const {
  const double rpm_per_s = acceleration.value * gear_ratio / 6.0;
  const bool by_time = profile.acceleration_unit == DriveProfile::AccelerationUnit::ms_per_1000_rpm;
  const double word = std::round(by_time ? 1e6 / rpm_per_s : rpm_per_s * pulses_per_motor_rev / 60.0);
  const double max = most(DriveProfile::Block::Word::acceleration, profile);
  if (!(rpm_per_s > 0.0 && word >= 1.0 && word <= max)) {
    return fail(ErrorCode::out_of_range, "{} deg/s2 is {:.0f} in the drive's unit, 1 to {:.0f} can be written",
                acceleration.value, word, max);
  }
  return static_cast<std::uint32_t>(word);
}

}  // namespace scanrig
