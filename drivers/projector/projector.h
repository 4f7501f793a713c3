#pragma once

#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig {

/// Light of an exposure.
enum class Light {
  pattern,  ///< random-dot pattern on: the exposure that gives shape
  plain,    ///< pattern off, plain light on: the exposure that gives texture and silhouette
};

/// The random-dot projector. Its trigger edge is also the cameras' trigger: one fire() is one exposure.
/// Threads: one owner; only request_off() may be called from any other thread.
class Projector {
 public:
  virtual ~Projector() = default;

  /// Fires one exposure and returns when the pulse is over and the light is off again.
  /// Fails with `timeout`, `protocol`, `io`, `device_alarm`.
  virtual Result<void> fire(Light light, Deadline deadline) = 0;

  /// Switches the light off, confirmed where the device can report it. Fails with `timeout`, `protocol`, `io`.
  virtual Result<void> turn_off(Deadline deadline) = 0;

  virtual void request_off() noexcept = 0;

  /// What the device reports of itself, such as its firmware; empty before the first connection, or if it reports none.
  [[nodiscard]] virtual std::string description() const { return {}; }
};

}  // namespace scanrig
