#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "sim/wire/modbus_server.h"
#include "sim/wire/simulated_drive.h"

namespace scanrig::sim::wire {

/// A drive that is spoken to through registers: those it has, those that mean something when written.
class RegisterDrive : public RegisterDevice, public SimulatedDrive {
 public:
  std::uint8_t read(std::uint16_t address, std::span<std::uint16_t> values) final;
  std::uint8_t write(std::uint16_t address, std::span<const std::uint16_t> values) final;

  /// What the register holds now.
  [[nodiscard]] std::uint16_t peek(std::uint16_t address) const;

 protected:
  using SimulatedDrive::SimulatedDrive;

  void add_registers(unsigned first, unsigned last);
  /// 32 bits in two registers, upper word first.
  [[nodiscard]] std::int32_t pair(unsigned upper) const;
  void put_pair(unsigned upper, std::int32_t value) const;

  /// 0, or the Modbus exception code of a request that is refused as a whole.
  [[nodiscard]] virtual std::uint8_t refuses(std::uint16_t address, std::span<const std::uint16_t> values) const = 0;
  /// Once for each register of a request, in turn: it holds the new value already.
  virtual void written(std::uint16_t address, std::uint16_t before) = 0;

  mutable std::map<std::uint16_t, std::uint16_t> registers_;
  mutable bool homed_ = false;
  mutable bool homing_ = false;
  bool alarm_can_be_reset_ = true;
  Clock::TimePoint last_request_{};  ///< that reached the drive
};

}  // namespace scanrig::sim::wire
