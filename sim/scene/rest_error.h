#pragma once

#include <cmath>

#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {

/// Distance from the commanded angle to the rest position of the table of the rig `seed`. The same for the same angle
/// and two turns further, however the table moves. So every simulation of one rig rests alike, and so does the next
/// job, whose two poses are two turns.
inline double rest_error_deg(double commanded_deg, std::uint64_t seed) {
  constexpr long long kTwoTurns = 72000;  // hundredths of a degree
  const auto place = (std::llround(100.0 * commanded_deg) % kTwoTurns + kTwoTurns) % kTwoTurns;
  return profile().repeatability_deg * normal(mix(seed, 8, place));
}

inline double resting_angle(double commanded_deg, std::uint64_t seed) {
  return commanded_deg + rest_error_deg(commanded_deg, seed);
}

/// Reading of the table's encoder: a whole number of its steps.
inline double encoder_reading(double true_deg) {
  const double step = profile().encoder_step_deg;
  return std::round(true_deg / step) / std::round(1.0 / step);
}

}  // namespace scanrig::sim
