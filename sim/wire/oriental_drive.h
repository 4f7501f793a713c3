#pragma once

#include <cstdint>
#include <map>

#include "sim/wire/modbus_server.h"
#include "sim/wire/simulated_drive.h"

namespace scanrig::sim::wire {

/// An Oriental Motor AZ drive with its motor and table: direct data operation, input command and output status, both
/// words of every pair; an absolute encoder that keeps its count without power. The motor's own zero is where the table
/// stands at the home switch.
/// Threads: every function may be called from any thread.
class OrientalDrive final : public RegisterDevice, public SimulatedDrive {
 public:
  OrientalDrive(const AxisOptions& axis, Clock& clock);

  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) override;
  std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) override;

  using SimulatedDrive::raise_alarm;
  void raise_alarm(std::uint16_t code, bool can_be_reset) override;
  void power_cycle() override;  ///< alarm and HOME-END are gone, the count stays
  void send(std::int32_t pulses) override;

 private:
  void input(std::uint16_t now);
  void start_direct_data();
  [[nodiscard]] std::int32_t pair(std::uint16_t upper) const;
  void put_pair(std::uint16_t upper, std::int32_t value) const;
  [[nodiscard]] std::uint16_t status() const;
  void follow() const override;

  mutable std::map<std::uint16_t, std::uint16_t> registers_;
  mutable bool homed_ = false;
  mutable bool homing_ = false;
  bool alarm_can_be_reset_ = true;
};

}  // namespace scanrig::sim::wire
