#include "sim/devices/bench.h"

#include <algorithm>
#include <cmath>

#include "sim/scene/profile.h"

namespace scanrig::sim {
namespace {

/// A view that is taken again replaces the one before.
void remember(std::vector<double>& angles_deg, double angle) {
  constexpr double kSameView = 0.5;  // deg
  const auto same = [&](double other) { return std::abs(std::remainder(other - angle, 360.0)) < kSameView; };
  const auto known = std::find_if(angles_deg.begin(), angles_deg.end(), same);
  if (known != angles_deg.end()) {
    *known = angle;
  } else {
    angles_deg.push_back(angle);
  }
}

}  // namespace

void Bench::edge(Light light) {
  ++triggers;
  if (!armed) return;
  armed = false;
  const auto exposure_time =
      std::chrono::duration_cast<Clock::Duration>(std::chrono::duration<double>(profile().exposure_s));
  constexpr auto kTransfer = std::chrono::milliseconds(25);
  const auto now = clock.now();
  const double angle = axis.angle(now + exposure_time / 2);
  remember(history.back().angles_deg, angle);
  ++exposures;
  if (frames_to_lose > 0) {
    --frames_to_lose;
    return;
  }
  in_flight = Exposure{history.back().placement,       angle, light == Light::pattern, exposures, triggers, now,
                       now + exposure_time + kTransfer};
  clock.notify_all(changed);
}

}  // namespace scanrig::sim
