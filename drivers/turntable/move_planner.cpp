#include "drivers/turntable/move_planner.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scanrig {

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
