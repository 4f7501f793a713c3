#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "core/clock.h"
#include "sim/wire/axis.h"
#include "sim/wire/modbus_server.h"

namespace scanrig::sim::wire {

/// A Leadshine RS drive with its motor and table: registers as in docs, "Turntable, Leadshine RS family".
/// Threads: every function may be called from any thread.
class LeadshineDrive final : public RegisterDevice {
 public:
  LeadshineDrive(const AxisOptions& axis, Clock& clock);

  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) override;
  std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) override;

  // Faults.
  void block(bool blocked);        ///< the shaft does not turn; the drive does not notice
  void lose_steps(double pulses);  ///< now
  void raise_alarm(std::uint16_t code, bool can_be_reset = true);
  void power_cycle();  ///< alarm, home and enable are gone, the counter starts at 0
  void preload_counter(std::int32_t value);
  void set_physics(const AxisOptions& options);  ///< as Axis::set_physics()

  // Truth.
  [[nodiscard]] AxisTruth truth() const;
  [[nodiscard]] std::vector<AxisLeg> legs() const;
  [[nodiscard]] std::int32_t counter() const;
  [[nodiscard]] std::uint16_t peek(std::uint16_t address) const;

 private:
  void trigger(std::uint16_t value);
  void control(std::uint16_t value);
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] AxisMotion motion(std::uint16_t rpm, std::uint16_t acceleration, std::uint16_t deceleration) const;
  void refresh() const;  // advances the axis and the registers that follow it

  Clock& clock_;
  const double pulses_per_motor_rev_;
  mutable std::mutex mutex_;
  mutable Axis axis_;
  mutable std::map<std::uint16_t, std::uint16_t> registers_;
  mutable bool homed_ = false;
  mutable bool homing_ = false;
  bool alarm_can_be_reset_ = true;
};

}  // namespace scanrig::sim::wire
