#pragma once

#include <cstdint>

#include "sim/wire/register_drive.h"

namespace scanrig::sim::wire {

/// An Oriental Motor AZ drive with its motor and table: direct data operation, input command and output status, both
/// words of every pair; an absolute encoder that keeps its count without power. The motor's own zero is where the table
/// stands at the home switch.
/// Threads: every function may be called from any thread.
class OrientalDrive final : public RegisterDrive {
 public:
  OrientalDrive(const AxisOptions& axis, Clock& clock);

  using SimulatedDrive::raise_alarm;
  void raise_alarm(std::uint16_t code, bool can_be_reset) override;
  void power_cycle() override;  ///< alarm and HOME-END are gone, the count stays
  void send(std::int32_t pulses) override;

 private:
  [[nodiscard]] std::uint8_t refuses(std::uint16_t address, std::span<const std::uint16_t> values) const override;
  void written(std::uint16_t address, std::uint16_t before) override;
  void input(std::uint16_t before, std::uint16_t now);
  void start_direct_data();
  [[nodiscard]] std::uint16_t status() const;
  void pass_time(Clock::TimePoint now) const override;
  void follow() const override;
};

}  // namespace scanrig::sim::wire
