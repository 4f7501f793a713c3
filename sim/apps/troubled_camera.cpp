#include "sim/apps/troubled_camera.h"

#include <limits>

#include "sim/scene/random.h"

namespace scanrig::sim {

Result<void> TroubledCamera::arm(Deadline deadline) {
  const auto chance = mix(seed_, ++exposures_);
  if (uniform(chance) < share_) {
    switch (mix(chance) % 5) {
      case 0: rig_.lose_frames(1); break;
      case 1: rig_.lose_frames(std::numeric_limits<int>::max()); break;
      case 2: rig_.stall_turntable(true); break;
      case 3: rig_.set_guard(false); break;
      default: rig_.set_estop(false); break;
    }
  }
  return rig_.camera().arm(deadline);
}

}  // namespace scanrig::sim
