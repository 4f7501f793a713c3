#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>

#include "drivers/modbus/bus.h"
#include "drivers/projector/projector.h"

namespace scanrig {

struct ModbusIoProjectorOptions {
  modbus::ClientOptions line;               ///< of the I/O module
  std::uint16_t pattern_coil = 0;           ///< fires the pattern and both cameras
  std::optional<std::uint16_t> plain_coil;  ///< fires plain light and both cameras
  bool active_low = false;                  ///< both coils: light is on when the coil is off
  std::chrono::microseconds pulse{15000};   ///< at least the cameras' exposure
};

/// A dot projector fired by an output of a Modbus RTU I/O module, whose edge is also the cameras' trigger. The module
/// may be the panel's: they share its bus. A pulse lasts as configured, plus up to two requests of the panel. Off is
/// confirmed by reading back. request_off() ends a running pulse, and fire() then fails with `io`. A plain exposure
/// fails with `unsupported` when there is no coil for it.
class ModbusIoProjector final : public Projector {
 public:
  /// The port is opened by the first use.
  ModbusIoProjector(ModbusIoProjectorOptions options, Clock& clock);

  Result<void> fire(Light light, Deadline deadline) override;
  Result<void> turn_off(Deadline deadline) override;
  void request_off() noexcept override;

 private:
  /// Repeated once when its reply was missed: writing twice does no harm.
  Result<void> write(std::uint16_t coil, bool lit, Deadline deadline);
  Result<void> switch_off(std::uint16_t coil, Deadline deadline);

  const ModbusIoProjectorOptions options_;
  Clock& clock_;
  const std::shared_ptr<modbus::Bus> bus_;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool dark_requested_ = false;  // guarded by mutex_
};

}  // namespace scanrig
