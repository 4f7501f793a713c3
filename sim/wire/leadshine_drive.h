#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "core/clock.h"
#include "sim/wire/mechanics.h"
#include "sim/wire/modbus_server.h"

namespace scanrig::sim::wire {

/// A Leadshine RS drive with its motor and table: registers as in docs, "Turntable, Leadshine RS family".
/// Threads: every function may be called from any thread.
class LeadshineDrive final : public RegisterDevice, public Mechanics {
 public:
  LeadshineDrive(const AxisOptions& axis, Clock& clock);

  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) override;
  std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) override;

  void raise_alarm(std::uint16_t code, bool can_be_reset = true) override;
  void power_cycle() override;  ///< alarm, home and enable are gone, the counter starts at 0
  [[nodiscard]] std::uint16_t peek(std::uint16_t address) const;

 private:
  void trigger(std::uint16_t value);
  void control(std::uint16_t value);
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] AxisMotion motion(std::uint16_t rpm, std::uint16_t acceleration, std::uint16_t deceleration) const;
  void refresh() const override;  // and the registers that follow the axis

  mutable std::map<std::uint16_t, std::uint16_t> registers_;
  mutable bool homed_ = false;
  mutable bool homing_ = false;
  bool alarm_can_be_reset_ = true;
};

}  // namespace scanrig::sim::wire
