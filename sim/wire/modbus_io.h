#pragma once

#include <mutex>
#include <vector>

#include "sim/wire/modbus_server.h"

namespace scanrig::sim::wire {

/// A Modbus I/O module without registers: discrete inputs that hands and contacts move, coils that drive lamps.
/// Threads: every function may be called from any thread.
class ModbusIoModule final : public RegisterDevice {
 public:
  ModbusIoModule(std::size_t inputs, std::size_t coils) : inputs_(inputs), coils_(coils) {}

  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) override;
  std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) override;
  std::uint8_t read_bits(std::uint8_t function, std::uint16_t address, std::vector<bool>& bits) override;
  std::uint8_t write_coils(std::uint16_t address, const std::vector<bool>& bits) override;

  void set(std::size_t input, bool closed);  ///< action of a hand on a button
  void power_cycle();                        ///< all coils are off again

  [[nodiscard]] bool coil(std::size_t number) const;

 private:
  mutable std::mutex mutex_;
  std::vector<bool> inputs_;
  std::vector<bool> coils_;
};

}  // namespace scanrig::sim::wire
