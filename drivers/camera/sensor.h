#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "drivers/camera/decoded_image.h"

namespace scanrig {

/// When a sensor exposed a frame, in its own words.
struct FrameStamp {
  std::uint64_t id = 0;
  std::chrono::nanoseconds time{0};  ///< begin of the exposure on the sensor's clock
};

struct SensorFrame {
  FrameStamp stamp;
  DecodedImage picture;
  std::string damage;          ///< why the frame is not whole; empty if it is
  Clock::TimePoint arrival{};  ///< when this process had it
};

/// One sensor, as StereoCamera is made of: a queue of frames, one for each trigger.
/// Threads: one owner.
class Sensor {
 public:
  virtual ~Sensor() = default;

  [[nodiscard]] virtual const std::string& name() const = 0;  ///< "left camera 40012345"

  /// Connected and waiting for triggers; connects again if the device was lost. True if it was connected anew: ids and
  /// clock may have begun again. Fails with `not_found`, `io`, `timeout`, `unsupported`, `invalid_input`.
  virtual Result<bool> prepare(Deadline deadline) = 0;

  /// The oldest frame not yet taken; nothing if there is none by the deadline. Fails with `io`, `unsupported`.
  virtual Result<std::optional<SensorFrame>> next(Deadline deadline) = 0;

  /// Whether trigger() can be used, and how many ids there are before they begin again (0: never).
  [[nodiscard]] virtual bool can_trigger() const = 0;
  [[nodiscard]] virtual std::uint64_t id_ring() const = 0;

  /// Whether stamps are of the host's steady clock.
  [[nodiscard]] virtual bool shares_host_clock() const = 0;

  /// Whether the line or trigger() exposes. Fail with `io`, `timeout`.
  virtual Result<void> listen_to_line(bool line) = 0;
  virtual Result<void> trigger() = 0;
};

}  // namespace scanrig
