#pragma once

#include <cmath>

#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {

/// How far from the angle it was sent to the table of the rig `seed` comes to rest. Sent there again, or two turns
/// further, it is as far off, whatever moved it: so every simulation of one rig stands alike, and so does the next job,
/// whose two poses are two turns.
inline double rest_error_deg(double commanded_deg, std::uint64_t seed) {
  constexpr long long kTwoTurns = 72000;  // hundredths of a degree
  const auto place = (std::llround(100.0 * commanded_deg) % kTwoTurns + kTwoTurns) % kTwoTurns;
  return profile().repeatability_deg * normal(mix(seed, 8, place));
}

inline double resting_angle(double commanded_deg, std::uint64_t seed) {
  return commanded_deg + rest_error_deg(commanded_deg, seed);
}

/// What the table's encoder reads: a whole number of its steps.
inline double encoder_reading(double true_deg) {
  const double step = profile().encoder_step_deg;
  return std::round(true_deg / step) / std::round(1.0 / step);
}

}  // namespace scanrig::sim
