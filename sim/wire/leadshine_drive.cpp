#include "sim/wire/leadshine_drive.h"

namespace scanrig::sim::wire {
namespace {

constexpr std::uint8_t kIllegalAddress = 2;
constexpr std::uint16_t kPulses = 0x0001, kEnable = 0x000F, kStatus = 0x1003, kFeedback = 0x1014, kControl = 0x1801,
                        kAlarm = 0x2203, kTrigger = 0x6002, kHomeFast = 0x600F, kHomeSlow = 0x6010,
                        kHomeAcceleration = 0x6011, kHomeDeceleration = 0x6012, kCommandPosition = 0x602A,
                        kMotorPosition = 0x602C, kMove = 0x6200, kMoveGo = 0x6207;

std::int32_t joined(std::uint16_t high, std::uint16_t low) {
  return static_cast<std::int32_t>(std::uint32_t{high} << 16 | low);
}

}  // namespace

LeadshineDrive::LeadshineDrive(const AxisOptions& axis, Clock& clock) : Mechanics(axis, clock) {
  for (const std::uint16_t address : {kPulses, kEnable, kStatus, kControl, kAlarm, std::uint16_t{0x6000}, kTrigger}) {
    registers_[address] = 0;
  }
  const auto add_block = [&](std::uint16_t first, std::uint16_t last) {
    for (unsigned address = first; address <= last; ++address) registers_[static_cast<std::uint16_t>(address)] = 0;
  };
  add_block(kFeedback, kFeedback + 1);
  add_block(0x6006, 0x600A);
  add_block(kHomeFast, kHomeDeceleration);
  add_block(kCommandPosition, kMotorPosition + 1);
  add_block(kMove, kMoveGo);
  registers_[kPulses] = static_cast<std::uint16_t>(axis.pulses_per_motor_rev);
}

std::uint8_t LeadshineDrive::read(std::uint16_t address, std::span<std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  refresh();
  for (std::uint16_t& value : values) {
    const auto found = registers_.find(address++);
    if (found == registers_.end()) return kIllegalAddress;
    value = found->second;
  }
  return 0;
}

std::uint8_t LeadshineDrive::write(std::uint16_t address, std::span<const std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  refresh();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!registers_.contains(static_cast<std::uint16_t>(address + i))) return kIllegalAddress;
  }
  for (const std::uint16_t value : values) {
    registers_[address] = value;
    if (address == kTrigger || address == kMoveGo) trigger(value);
    if (address == kControl) control(value);
    ++address;
  }
  refresh();
  return 0;
}

void LeadshineDrive::trigger(std::uint16_t value) {
  if (value == 0x40) {
    homing_ = false;
    axis_.quick_stop();
    return;
  }
  if (registers_[kAlarm] != 0 || registers_[kEnable] != 1) return;
  if (value == 0x10 && registers_[kMove] == 0x0001) {
    homing_ = false;
    axis_.move_to(joined(registers_[kMove + 1], registers_[kMove + 2]),
                  motion(registers_[kMove + 3], registers_[kMove + 4], registers_[kMove + 5]));
  } else if (value == 0x20) {
    homed_ = false;
    homing_ = true;
    axis_.seek_home(motion(registers_[kHomeFast], registers_[kHomeAcceleration], registers_[kHomeDeceleration]));
  } else if (value == 0x21) {
    axis_.set_counter(0);
    homed_ = true;
  }
}

void LeadshineDrive::control(std::uint16_t value) {
  if (value == 0x1111 && alarm_can_be_reset_) registers_[kAlarm] = 0;
}

AxisMotion LeadshineDrive::motion(std::uint16_t rpm, std::uint16_t acceleration, std::uint16_t deceleration) const {
  // Accelerations are given as the milliseconds that 1000 rpm take.
  const auto pulses = [&](double per_minute) { return per_minute * options_.pulses_per_motor_rev / 60.0; };
  const auto rate = [&](std::uint16_t ms) { return pulses(1000.0) / (std::max<double>(ms, 1.0) / 1000.0); };
  return {pulses(rpm), rate(acceleration), rate(deceleration)};
}

void LeadshineDrive::refresh() const {
  axis_.advance(clock_.now());
  if (homing_ && !axis_.running()) {
    homing_ = false;
    homed_ = axis_.reached_switch();
  }
  const auto put = [&](std::uint16_t address, std::int32_t value) {
    registers_[address] = static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) >> 16);
    registers_[address + 1] = static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) & 0xFFFF);
  };
  put(kCommandPosition, axis_.commanded());
  put(kMotorPosition, axis_.measured());
  put(kFeedback, axis_.measured());
  registers_[kStatus] = status();
  registers_[kTrigger] = axis_.running() ? 0x100 : 0x000;
}

std::uint16_t LeadshineDrive::status() const {
  const bool fault = registers_[kAlarm] != 0;
  unsigned bits = 0;
  if (fault) bits |= 1u << 0;
  if (registers_[kEnable] == 1 && !fault) bits |= 1u << 1;
  if (axis_.running()) bits |= 1u << 2;
  if (!axis_.running()) bits |= 1u << 4 | 1u << 5;
  if (homed_) bits |= 1u << 6;
  return static_cast<std::uint16_t>(bits);
}

void LeadshineDrive::raise_alarm(std::uint16_t code, bool can_be_reset) {
  const std::scoped_lock lock(mutex_);
  refresh();
  registers_[kAlarm] = code;
  alarm_can_be_reset_ = can_be_reset;
  axis_.quick_stop();
}

void LeadshineDrive::power_cycle() {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.quick_stop();
  axis_.set_counter(0);
  homed_ = homing_ = false;
  registers_[kAlarm] = registers_[kEnable] = 0;
}

std::uint16_t LeadshineDrive::peek(std::uint16_t address) const {
  const std::scoped_lock lock(mutex_);
  refresh();
  return registers_[address];
}

}  // namespace scanrig::sim::wire
