#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/units.h"
#include "drivers/turntable/axis_scale.h"

namespace scanrig {

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

/// Chooses the way to an angle: which turn, from which side, inside which limits.
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
