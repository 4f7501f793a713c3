#include "sim/wire/oriental_drive.h"

#include <cmath>
#include <cstdlib>

namespace scanrig::sim::wire {
namespace {

constexpr std::uint8_t kIllegalAddress = 2;
constexpr std::uint16_t kDirectData = 0x0058, kType = 0x005A, kPosition = 0x005C, kSpeed = 0x005E, kUp = 0x0060,
                        kDown = 0x0062, kTrigger = 0x0066, kDirectDataEnd = 0x0069, kInput = 0x007D, kOutput = 0x007F,
                        kAlarm = 0x0080, kCommand = 0x00C6, kFeedback = 0x00CC, kPreset = 0x018A;
constexpr unsigned kHomeInput = 1u << 4, kStopInput = 1u << 5, kAlarmResetInput = 1u << 7;
constexpr std::int32_t kAbsolute = 1, kRelative = 2;
constexpr std::int64_t kInPosition = 50;  // pulses: 1.8 deg of the motor, the drive's default

}  // namespace

OrientalDrive::OrientalDrive(const AxisOptions& axis, Clock& clock) : Mechanics(axis, clock) {
  const auto add_block = [&](unsigned first, unsigned last) {
    for (unsigned address = first; address <= last; ++address) registers_[static_cast<std::uint16_t>(address)] = 0;
  };
  add_block(kDirectData, kDirectDataEnd);
  add_block(0x007C, kAlarm + 1);
  add_block(kCommand, kCommand + 1);
  add_block(kFeedback, kFeedback + 1);
  add_block(kPreset, kPreset + 1);
  const double per_degree = axis.pulses_per_motor_rev * axis.gear_ratio / 360.0;
  axis_.set_counter(static_cast<std::int32_t>(std::lround(axis.start_deg * per_degree)));
}

std::uint8_t OrientalDrive::read(std::uint16_t address, std::span<std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  refresh();
  for (std::uint16_t& value : values) {
    const auto found = registers_.find(address++);
    if (found == registers_.end()) return kIllegalAddress;
    value = found->second;
  }
  return 0;
}

std::uint8_t OrientalDrive::write(std::uint16_t address, std::span<const std::uint16_t> values) {
  const std::scoped_lock lock(mutex_);
  refresh();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!registers_.contains(static_cast<std::uint16_t>(address + i))) return kIllegalAddress;
  }
  for (const std::uint16_t value : values) {
    const std::uint16_t before = registers_[address];
    registers_[address] = value;
    if (address == kTrigger + 1 && value == 1) direct_data();
    if (address == kInput) input_command(before, value);
    if (address == kPreset + 1 && before == 0 && value == 1 && !axis_.running()) {
      axis_.set_counter(0);
      home_end_ = true;
    }
    ++address;
  }
  refresh();
  return 0;
}

void OrientalDrive::direct_data() {
  const std::int32_t type = pair(kType);
  if (alarm_ != 0 || (type != kAbsolute && type != kRelative)) return;
  returning_ = home_end_ = false;
  if (!axis_.running()) axis_.follow_encoder();
  axis_.move_to(pair(kPosition) + (type == kRelative ? axis_.commanded() : 0),
                {static_cast<double>(pair(kSpeed)), static_cast<double>(pair(kUp)), static_cast<double>(pair(kDown))});
}

void OrientalDrive::input_command(std::uint16_t before, std::uint16_t now) {
  const unsigned risen = now & ~static_cast<unsigned>(before);
  if ((risen & kAlarmResetInput) != 0 && alarm_can_be_reset_) alarm_ = 0;
  if ((now & kStopInput) != 0) {
    returning_ = false;
    axis_.quick_stop();
  } else if ((risen & kHomeInput) != 0 && alarm_ == 0) {
    const double per_degree = options_.pulses_per_motor_rev * options_.gear_ratio / 360.0;
    home_end_ = false;
    returning_ = true;
    if (!axis_.running()) axis_.follow_encoder();
    axis_.move_to(0, {90.0 * per_degree, 900.0 * per_degree, 900.0 * per_degree});
  }
}

void OrientalDrive::refresh() const {
  axis_.advance(clock_.now());
  if (returning_ && !axis_.running()) {
    returning_ = false;
    home_end_ = axis_.commanded() == 0;
  }
  const auto put = [&](std::uint16_t upper, std::int32_t value) {
    registers_[upper] = static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) >> 16);
    registers_[upper + 1] = static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) & 0xFFFF);
  };
  put(kCommand, axis_.commanded());
  put(kFeedback, axis_.measured());
  put(kAlarm, alarm_);
  registers_[kOutput] = status();
}

std::uint16_t OrientalDrive::status() const {
  const bool moving = axis_.running();
  unsigned bits = 0;
  if (home_end_) bits |= 1u << 4;
  if (!moving && alarm_ == 0) bits |= 1u << 5;  // READY
  if (alarm_ != 0) bits |= 1u << 7;             // ALM-A
  if (moving) bits |= 1u << 13;                 // MOVE
  if (!moving && std::abs(std::int64_t{axis_.commanded()} - axis_.measured()) <= kInPosition) bits |= 1u << 14;
  return static_cast<std::uint16_t>(bits);
}

std::int32_t OrientalDrive::pair(std::uint16_t upper) const {
  return static_cast<std::int32_t>(std::uint32_t{registers_[upper]} << 16 | registers_[upper + 1]);
}

void OrientalDrive::raise_alarm(std::uint16_t code, bool can_be_reset) {
  const std::scoped_lock lock(mutex_);
  refresh();
  alarm_ = code;
  alarm_can_be_reset_ = can_be_reset;
  axis_.quick_stop();
}

void OrientalDrive::power_cycle() {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.quick_stop();
  returning_ = home_end_ = false;
  alarm_ = 0;
}

}  // namespace scanrig::sim::wire
