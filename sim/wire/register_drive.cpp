#include "sim/wire/register_drive.h"

namespace scanrig::sim::wire {
namespace {}  // namespace

std::uint8_t RegisterDrive::read(std::uint16_t address, std::span<std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  refresh();
  last_request_ = clock_.now();
  for (std::uint16_t& value : values) {
    const auto found = registers_.find(address++);
    if (found == registers_.end()) return kIllegalAddress;
    value = found->second;
  }
  return 0;
}

std::uint8_t RegisterDrive::write(std::uint16_t address, std::span<const std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  refresh();
  last_request_ = clock_.now();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!registers_.contains(static_cast<std::uint16_t>(address + i))) return kIllegalAddress;
  }
  if (const std::uint8_t exception = refuses(address, values); exception != 0) return exception;
  for (const std::uint16_t value : values) {
    const std::uint16_t before = std::exchange(registers_[address], value);
    written(address, before);
    ++address;
  }
  refresh();
  return 0;
}

std::uint16_t RegisterDrive::peek(std::uint16_t address) const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return registers_[address];
}

void RegisterDrive::add_registers(unsigned first, unsigned last) {
  for (unsigned address = first; address <= last; ++address) registers_[static_cast<std::uint16_t>(address)] = 0;
}

std::int32_t RegisterDrive::pair(unsigned upper) const {
  return static_cast<std::int32_t>(std::uint32_t{registers_[static_cast<std::uint16_t>(upper)]} << 16 |
                                   registers_[static_cast<std::uint16_t>(upper + 1)]);
}

void RegisterDrive::put_pair(unsigned upper, std::int32_t value) const {
  const auto bits = static_cast<std::uint32_t>(value);
  registers_[static_cast<std::uint16_t>(upper)] = static_cast<std::uint16_t>(bits >> 16);
  registers_[static_cast<std::uint16_t>(upper + 1)] = static_cast<std::uint16_t>(bits & 0xFFFF);
}

}  // namespace scanrig::sim::wire
