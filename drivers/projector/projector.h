#pragma once

#include "core/clock.h"
#include "core/result.h"

namespace scanrig {

/// What the projector shows during an exposure.
enum class Light {
  pattern,  ///< random dots on: the exposure that gives shape
  plain,    ///< dots off, even light: the exposure that gives texture and silhouette
};

/// The random-dot projector. Its trigger edge is also the cameras' trigger: one fire() is one exposure.
/// Threads: one owner; only request_off() may be called from another.
class Projector {
 public:
  virtual ~Projector() = default;

  /// Fires one exposure and returns when the pulse is over and the dots are dark again.
  /// Fails with `timeout`, `protocol`, `io`, `device_alarm`.
  virtual Result<void> fire(Light light, Deadline deadline) = 0;

  /// Dots off, seen off where the device can tell. Fails with `timeout`, `protocol`, `io`.
  virtual Result<void> turn_off(Deadline deadline) = 0;

  virtual void request_off() noexcept = 0;
};

}  // namespace scanrig
