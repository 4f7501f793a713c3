#pragma once

#include <cstdint>

#include "core/clock.h"
#include "sim/wire/register_drive.h"

namespace scanrig::sim::wire {

/// A Leadshine RS drive with its motor and table: registers as in docs, "Turntable, Leadshine RS family".
/// Threads: every function may be called from any thread.
class LeadshineDrive final : public RegisterDrive {
 public:
  LeadshineDrive(const AxisOptions& axis, Clock& clock);

  using SimulatedDrive::raise_alarm;
  void raise_alarm(std::uint16_t code, bool can_be_reset) override;
  void power_cycle() override;  ///< alarm, home and enable are gone, the counter starts at 0
  void send(std::int32_t pulses) override;

 private:
  [[nodiscard]] std::uint8_t refuses(std::uint16_t /*address*/,
                                     std::span<const std::uint16_t> /*values*/) const override {
    return 0;
  }
  void written(std::uint16_t address, std::uint16_t before) override;
  void trigger(std::uint16_t value);
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] AxisMotion motion(std::uint16_t rpm, std::uint16_t acceleration, std::uint16_t deceleration) const;
  void follow() const override;
};

}  // namespace scanrig::sim::wire
