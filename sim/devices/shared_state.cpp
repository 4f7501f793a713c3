#include "sim/devices/shared_state.h"

#include "sim/scene/profile.h"

namespace scanrig::sim {

double SharedState::true_angle_deg(Clock::TimePoint at) const {
  return scene->drawn_rig().table.true_deg(axis.angle(at));
}

Clock::Duration SharedState::exposure_time() const {
  return std::chrono::round<Clock::Duration>(std::chrono::duration<double>(exposure_factor * profile().exposure_s));
}

void SharedState::edge(Light light) {
  ++triggers;
  if (!armed) return;
  armed = false;
  constexpr auto kTransfer = std::chrono::milliseconds(25);
  const auto now = clock.now();
  const double angle = true_angle_deg(now + exposure_time() / 2);
  if (board_placement == 0) history.exposed(angle);
  ++exposures;
  if (frames_to_lose > 0) {
    --frames_to_lose;
    return;
  }
  in_flight = Exposure{.placement = history.placement(),
                       .board = board_placement,
                       .angle_deg = angle,
                       .pattern = light == Light::pattern,
                       .factor = exposure_factor,
                       .number = exposures,
                       .trigger = triggers,
                       .taken = now,
                       .arrival = now + exposure_time() + kTransfer};
  clock.notify_all(changed);
}

}  // namespace scanrig::sim
