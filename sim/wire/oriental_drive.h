#pragma once

#include <cstdint>
#include <map>

#include "core/clock.h"
#include "sim/wire/mechanics.h"
#include "sim/wire/modbus_server.h"

namespace scanrig::sim::wire {

/// An Oriental Motor AZ drive with its motor and table: registers as in the profile's sources. The encoder is absolute:
/// the counter outlives a power cycle, and home is its zero, which ZHOME turns back to.
/// Threads: every function may be called from any thread.
class OrientalDrive final : public RegisterDevice, public Mechanics {
 public:
  /// The zero is where the table stands when it is first switched on less `axis.start_deg`.
  OrientalDrive(const AxisOptions& axis, Clock& clock);

  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) override;
  std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) override;

  void raise_alarm(std::uint16_t code, bool can_be_reset = true) override;
  void power_cycle() override;  ///< an alarm is gone and the motor stands; the position stays

 private:
  void direct_data();
  void input_command(std::uint16_t before, std::uint16_t now);
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] std::int32_t pair(std::uint16_t upper) const;
  void refresh() const override;

  mutable std::map<std::uint16_t, std::uint16_t> registers_;
  mutable bool returning_ = false;
  mutable bool home_end_ = false;
  std::uint16_t alarm_ = 0;
  bool alarm_can_be_reset_ = true;
};

}  // namespace scanrig::sim::wire
