#include "sim/wire/leadshine_drive.h"

namespace scanrig::sim::wire {
namespace {

constexpr std::uint16_t kPulses = 0x0001, kEnable = 0x000F, kStatus = 0x1003, kFeedback = 0x1014, kControl = 0x1801,
                        kAlarm = 0x2203, kTrigger = 0x6002, kHomeFast = 0x600F, kHomeSlow = 0x6010,
                        kHomeAcceleration = 0x6011, kHomeDeceleration = 0x6012, kCommandPosition = 0x602A,
                        kMotorPosition = 0x602C, kMove = 0x6200, kMoveGo = 0x6207;

}  // namespace

LeadshineDrive::LeadshineDrive(const AxisOptions& axis, Clock& clock) : RegisterDrive(axis, clock) {
  for (const std::uint16_t address : {kPulses, kEnable, kStatus, kControl, kAlarm, std::uint16_t{0x6000}, kTrigger}) {
    registers_[address] = 0;
  }
  add_registers(kFeedback, kFeedback + 1);
  add_registers(0x6006, 0x600A);
  add_registers(kHomeFast, kHomeDeceleration);
  add_registers(kCommandPosition, kMotorPosition + 1);
  add_registers(kMove, kMoveGo);
  registers_[kPulses] = static_cast<std::uint16_t>(axis.pulses_per_motor_rev);
}

void LeadshineDrive::written(std::uint16_t address, std::uint16_t /*before*/) {
  const std::uint16_t value = registers_[address];
  if (address == kTrigger || address == kMoveGo) trigger(value);
  if (address == kControl && value == 0x1111 && alarm_can_be_reset_) registers_[kAlarm] = 0;
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
    axis_.move_to(pair(kMove + 1), motion(registers_[kMove + 3], registers_[kMove + 4], registers_[kMove + 5]));
  } else if (value == 0x20) {
    homed_ = false;
    homing_ = true;
    axis_.seek_home(motion(registers_[kHomeFast], registers_[kHomeAcceleration], registers_[kHomeDeceleration]));
  } else if (value == 0x21) {
    axis_.set_counter(0);
    homed_ = true;
  }
}

AxisMotion LeadshineDrive::motion(std::uint16_t rpm, std::uint16_t acceleration, std::uint16_t deceleration) const {
  // Accelerations are given as the milliseconds that 1000 rpm take.
  const auto pulses = [&](double per_minute) { return per_minute * pulses_per_motor_rev_ / 60.0; };
  const auto rate = [&](std::uint16_t ms) { return pulses(1000.0) / (std::max<double>(ms, 1.0) / 1000.0); };
  return {pulses(rpm), rate(acceleration), rate(deceleration)};
}

void LeadshineDrive::follow() const {
  if (homing_ && !axis_.running()) {
    homing_ = false;
    homed_ = axis_.reached_switch();
  }
  put_pair(kCommandPosition, axis_.commanded());
  put_pair(kMotorPosition, axis_.measured());
  put_pair(kFeedback, axis_.measured());
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

void LeadshineDrive::send(std::int32_t pulses) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.move_to(axis_.commanded() + pulses, motion(135, 100, 100));
}

}  // namespace scanrig::sim::wire
