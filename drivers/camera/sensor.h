#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "drivers/camera/camera_strobe.h"
#include "drivers/camera/decoded_image.h"

namespace scanrig {

/// Time when a sensor exposed a frame, as reported by the sensor.
struct FrameStamp {
  std::uint64_t id = 0;
  std::chrono::nanoseconds time{0};  ///< start of the exposure on the sensor's clock
};

struct SensorFrame {
  FrameStamp stamp;
  DecodedImage decoded;
  std::string damage;          ///< why the frame is incomplete; empty if it is whole
  Clock::TimePoint arrival{};  ///< time when this process received it
};

/// `factor` times the configured exposure, in whole microseconds.
inline std::chrono::microseconds scaled_exposure(std::chrono::microseconds configured, double factor) {
  return std::chrono::round<std::chrono::microseconds>(std::chrono::duration<double, std::micro>(configured) * factor);
}

/// One sensor of a StereoCamera: a queue of frames, one per trigger.
/// Threads: one owner.
class Sensor {
 public:
  virtual ~Sensor() = default;

  [[nodiscard]] virtual const std::string& name() const = 0;  ///< "left camera 40012345"

  /// Makes the sensor wait for triggers; reconnects if the device was lost. True if it was newly connected: ids and
  /// clock may have restarted. Fails with `not_found`, `io`, `timeout`, `unsupported`, `invalid_input`.
  virtual Result<bool> prepare(Deadline deadline) = 0;

  /// Takes the oldest queued frame; nothing if there is none by the deadline. Fails with `io`, `unsupported`.
  virtual Result<std::optional<SensorFrame>> next(Deadline deadline) = 0;

  /// True if trigger() can be used; and the number of ids until they restart (0: never).
  [[nodiscard]] virtual bool can_trigger() const = 0;
  [[nodiscard]] virtual std::uint64_t id_ring() const = 0;

  /// True if stamps are of the host's steady clock.
  [[nodiscard]] virtual bool shares_host_clock() const = 0;

  /// Selects whether the line or trigger() exposes. True if the acquisition was interrupted for it: frames still in
  /// flight are dropped, and ids may restart. Fails with `io`, `timeout`, `invalid_input`.
  virtual Result<bool> listen_to_line(bool line) = 0;
  /// Starts one exposure. Fails with `io`, `timeout`.
  virtual Result<void> trigger() = 0;

  /// See StereoCamera::scale_exposure().
  virtual Result<void> scale_exposure(double factor, Deadline deadline) = 0;

  /// Its outputs for a projector; null if there are none.
  [[nodiscard]] virtual CameraStrobe* strobe() { return nullptr; }
};

}  // namespace scanrig
