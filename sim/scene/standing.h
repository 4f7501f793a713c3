#pragma once

#include <cmath>

#include "sim/scene/profile.h"
#include "sim/scene/random.h"

namespace scanrig::sim {

/// Where the table comes to rest when told to go to `commanded_deg`; `key` names the move.
inline double resting_angle(double commanded_deg, std::uint64_t key) {
  return commanded_deg + profile().repeatability_deg * normal(key);
}

/// What the table's encoder reads.
inline double encoder_reading(double true_deg) {
  const double step = profile().encoder_step_deg;
  return step * std::round(true_deg / step);
}

}  // namespace scanrig::sim
