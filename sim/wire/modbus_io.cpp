#include "sim/wire/modbus_io.h"

#include <algorithm>

namespace scanrig::sim::wire {
namespace {

constexpr std::uint8_t kReadCoils = 1;

}  // namespace

std::uint8_t ModbusIoModule::read(std::uint16_t, std::span<std::uint16_t>) { return kIllegalFunction; }
std::uint8_t ModbusIoModule::write(std::uint16_t, std::span<const std::uint16_t>) { return kIllegalFunction; }

std::uint8_t ModbusIoModule::read_bits(std::uint8_t function, std::uint16_t address, std::vector<bool>& bits) {
  const std::scoped_lock lock(mutex_);
  const auto& source = function == kReadCoils ? coils_ : inputs_;
  if (bits.empty() || address + bits.size() > source.size()) return kIllegalAddress;
  std::copy_n(source.begin() + address, bits.size(), bits.begin());
  return 0;
}

std::uint8_t ModbusIoModule::write_coils(std::uint16_t address, const std::vector<bool>& bits) {
  const std::scoped_lock lock(mutex_);
  if (bits.empty() || address + bits.size() > coils_.size()) return kIllegalAddress;
  std::copy(bits.begin(), bits.end(), coils_.begin() + address);
  return 0;
}

void ModbusIoModule::set(std::size_t input, bool closed) {
  const std::scoped_lock lock(mutex_);
  inputs_.at(input) = closed;
}

void ModbusIoModule::power_cycle() {
  const std::scoped_lock lock(mutex_);
  std::fill(coils_.begin(), coils_.end(), false);
}

bool ModbusIoModule::coil(std::size_t number) const {
  const std::scoped_lock lock(mutex_);
  return coils_.at(number);
}

}  // namespace scanrig::sim::wire
