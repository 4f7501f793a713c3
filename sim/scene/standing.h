#pragma once

#include <cmath>

#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {

/// How far from the angle it was sent to the table of the rig `seed` comes to rest, turns counted from home. Sent there
/// again it comes to rest at the same place, whatever moved it: so every simulation of one rig stands alike.
inline double rest_error_deg(double commanded_deg, std::uint64_t seed) {
  const auto place = std::llround(1000.0 * commanded_deg);
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
