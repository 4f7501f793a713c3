#include "drivers/turntable/axis_scale.h"

#include <algorithm>
#include <array>
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

MovePlanner::Counter MovePlanner::counter_range() const {
  Counter range = device;
  if (soft_limits) {
    const auto [low, high] = std::minmax({scale.pulses(soft_limits->min), scale.pulses(soft_limits->max)});
    range.min = std::max(range.min, std::ceil(low));
    range.max = std::min(range.max, std::floor(high));
  }
  return range;
}

std::optional<MovePlan> MovePlanner::plan(std::int32_t from, Degrees target, bool backlash_taken_up) const {
  if (!std::isfinite(target.value)) return std::nullopt;
  const Counter range = counter_range();
  const Degrees here = scale.angle(std::clamp<double>(from, range.min, range.max));
  const double nearest_turn = std::round((here - target).value / 360.0);
  std::array<Degrees, 3> equivalents;
  for (int i = 0; i < 3; ++i) equivalents[i] = Degrees{target.value + 360.0 * (nearest_turn + i - 1)};
  std::ranges::stable_sort(equivalents, {}, [&](Degrees e) { return std::abs((e - here).value); });

  const auto fits = [&](Degrees angle) {
    const double pulses = std::round(scale.pulses(angle));
    return pulses >= range.min && pulses <= range.max;
  };
  const Degrees from_angle = scale.angle(from);
  for (const Degrees end : equivalents) {
    if (!fits(end)) continue;
    const Degrees way = end - from_angle;
    const bool direct = backlash_taken_up ? way >= Degrees{-tolerance.value} : way >= backlash;
    MovePlan plan;
    plan.target = static_cast<std::int32_t>(std::lround(scale.pulses(end)));
    if (!direct && backlash > Degrees{0.0}) {
      const Degrees before = end - backlash;
      if (!fits(before)) continue;
      plan.before = static_cast<std::int32_t>(std::lround(scale.pulses(before)));
    }
    return plan;
  }
  return std::nullopt;
}

}  // namespace scanrig
