#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/modbus_frame.h"
#include "sim/wire/wire_server.h"

namespace scanrig::sim::wire {

/// A device behind the server. A non-zero exception code refuses.
/// Threads: any.
class RegisterDevice {
 public:
  virtual ~RegisterDevice() = default;
  /// Fills `values`; returns 0 or a Modbus exception code.
  virtual std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) = 0;
  virtual std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) = 0;
  /// The same for bits: `function` 1 reads coils, 2 discrete inputs. Without them: illegal function.
  virtual std::uint8_t read_bits(std::uint8_t /*function*/, std::uint16_t /*address*/, std::vector<bool>& /*bits*/) {
    return kIllegalFunction;
  }
  virtual std::uint8_t write_coils(std::uint16_t /*address*/, const std::vector<bool>& /*bits*/) {
    return kIllegalFunction;
  }
};

/// A Modbus RTU device on a pseudo-terminal.
/// Threads: every function may be called from any thread.
class ModbusServer final : public WireServer {
 public:
  /// `link`: the port name that a driver opens. Fails with `io`.
  static Result<std::unique_ptr<ModbusServer>> start(std::filesystem::path link, std::uint8_t unit,
                                                     RegisterDevice& device, Clock& clock);
  ~ModbusServer() override { vanish(); }

  /// Called with every received request, before it is carried out; from the server's thread.
  void on_request(std::function<void(const ModbusRequest&)> listener);

 private:
  ModbusServer(std::filesystem::path link, std::uint8_t unit, RegisterDevice& device, Clock& clock)
      : WireServer(std::move(link), clock), unit_(unit), device_(device) {}

  void serve(const std::stop_token& stop, Pty& pty) override;
  void handle(const std::stop_token& stop, Pty& pty, const Bytes& frame);
  Bytes carry_out(const Bytes& frame, bool obey, std::uint8_t exception);

  const std::uint8_t unit_;
  RegisterDevice& device_;

  std::mutex listener_mutex_;
  std::function<void(const ModbusRequest&)> listener_;
};

}  // namespace scanrig::sim::wire
