#include "sim/wire/oriental_drive.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace scanrig::sim::wire {
namespace {

constexpr std::uint16_t kDirectData = 0x0058, kType = 0x005A, kPosition = 0x005C, kSpeed = 0x005E,
                        kAcceleration = 0x0060, kDeceleration = 0x0062, kCurrent = 0x0064, kTrigger = 0x0066,
                        kInput = 0x007D, kStatus = 0x007F, kAlarm = 0x0080, kCommandPosition = 0x00C6,
                        kFeedback = 0x00CC, kPreset = 0x018A, kGearA = 0x0380, kGearB = 0x0382, kTimeout = 0x138A;
constexpr std::uint16_t kZhome = 1u << 4, kStop = 1u << 5, kAlarmReset = 1u << 7;
constexpr double kInPositionPulses = 18;   ///< 1.8 degrees of a motor with 1000 pulses are 5; wider with a finer gear
constexpr double kZhomeTurnsPerS = 100;    ///< of the motor
constexpr double kZhomeTurnsPerS2 = 1000;  ///< of the motor
constexpr double kFactoryPulses = 1000;
constexpr std::uint16_t kTimeoutAlarm = 0x85;

}  // namespace

OrientalDrive::OrientalDrive(const AxisOptions& axis, Clock& clock) : RegisterDrive(axis, clock) {
  add_registers(kDirectData, kTrigger + 1);
  add_registers(0x007C, kAlarm + 1);
  add_registers(kCommandPosition, kCommandPosition + 1);
  add_registers(kFeedback, kFeedback + 1);
  add_registers(kPreset, kPreset + 1);
  add_registers(kGearA, kGearB + 1);
  add_registers(kTimeout, kTimeout + 1);
  put_pair(kGearA, 1);
  put_pair(kGearB, static_cast<std::int32_t>(axis.pulses_per_motor_rev / kFactoryPulses));
  axis_.set_counter(
      static_cast<std::int32_t>(std::lround(axis.start_deg * axis.pulses_per_motor_rev * axis.gear_ratio / 360.0)));
}

std::uint8_t OrientalDrive::refuses(std::uint16_t address, std::span<const std::uint16_t> values) const {
  for (const std::uint16_t told : {kStatus, kFeedback}) {
    if (told >= address && told < address + values.size()) return kIllegalAddress;
  }
  return address == kDirectData && values.size() == 16 && (values[3] < 1 || values[3] > 3) ? kIllegalValue : 0;
}

void OrientalDrive::written(std::uint16_t address, std::uint16_t before) {
  const std::uint16_t value = registers_[address];
  if (address == kInput) input(before, value);
  if (address == kTrigger + 1 && value == 1) start_direct_data();
  if (address == kPreset + 1 && value == 1 && before == 0) {
    axis_.set_counter(0);
    homed_ = true;
  }
}

/// STOP is a level, the others act on their edge.
void OrientalDrive::input(std::uint16_t before, std::uint16_t now) {
  const auto risen = static_cast<std::uint16_t>(now & ~before);
  if ((risen & kAlarmReset) != 0 && alarm_can_be_reset_) put_pair(kAlarm, 0);
  if ((now & kStop) != 0) {
    homing_ = false;
    axis_.quick_stop();
    return;
  }
  if ((risen & kZhome) == 0 || pair(kAlarm) != 0) return;
  homed_ = false;
  homing_ = true;
  axis_.follow_motor();
  axis_.move_to(0, {kZhomeTurnsPerS * pulses_per_motor_rev_, kZhomeTurnsPerS2 * pulses_per_motor_rev_,
                    kZhomeTurnsPerS2 * pulses_per_motor_rev_});
}

/// Refused in silence with an alarm or while STOP is held, as the real one does.
void OrientalDrive::start_direct_data() {
  if (pair(kAlarm) != 0 || (registers_[kInput] & kStop) != 0) return;
  if (pair(kSpeed) <= 0 || pair(kAcceleration) <= 0 || pair(kDeceleration) <= 0 || pair(kCurrent) <= 0) {
    put_pair(kAlarm, 0x70);  // operation data error
    return;
  }
  const bool absolute = pair(kType) == 1;
  homing_ = homed_ = false;  // HOME-END goes out with the next motion
  axis_.follow_motor();
  axis_.move_to(absolute ? pair(kPosition) : axis_.commanded() + pair(kPosition),
                {static_cast<double>(pair(kSpeed)), static_cast<double>(pair(kAcceleration)),
                 static_cast<double>(pair(kDeceleration))});
}

/// Nothing was received for as long as the parameter allows: alarm, and the motor stops.
void OrientalDrive::pass_time(Clock::TimePoint now) const {
  const std::chrono::milliseconds timeout(pair(kTimeout));
  if (timeout.count() <= 0 || now - last_request_ <= timeout || pair(kAlarm) != 0) return;
  axis_.advance(last_request_ + timeout);
  put_pair(kAlarm, kTimeoutAlarm);
  homing_ = false;
  axis_.quick_stop();
}

void OrientalDrive::follow() const {
  if (homing_ && !axis_.running()) {
    homing_ = false;
    homed_ = true;
  }
  put_pair(kCommandPosition, axis_.commanded());
  put_pair(kFeedback, axis_.measured());
  registers_[kStatus] = status();
}

std::uint16_t OrientalDrive::status() const {
  const bool alarm = pair(kAlarm) != 0;
  const bool stop_held = (registers_[kInput] & kStop) != 0;
  const double off = std::abs(static_cast<double>(axis_.commanded()) - axis_.measured());
  unsigned bits = 0;
  if (homed_) bits |= 1u << 4;
  if (!alarm && !axis_.running() && !stop_held) bits |= 1u << 5;
  if (alarm) bits |= 1u << 7;
  if (axis_.running()) bits |= 1u << 13;
  if (off <= kInPositionPulses * pulses_per_motor_rev_ / kFactoryPulses) bits |= 1u << 14;
  return static_cast<std::uint16_t>(bits);
}

void OrientalDrive::raise_alarm(std::uint16_t code, bool can_be_reset) {
  const std::scoped_lock lock(mutex_);
  refresh();
  put_pair(kAlarm, code);
  alarm_can_be_reset_ = can_be_reset;
  homing_ = false;
  axis_.quick_stop();
}

void OrientalDrive::power_cycle() {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.quick_stop();
  homed_ = homing_ = false;
  put_pair(kAlarm, 0);
  registers_[kInput] = 0;
  put_pair(kTimeout, 0);
}

void OrientalDrive::send(std::int32_t pulses) {
  const std::scoped_lock lock(mutex_);
  refresh();
  axis_.move_to(axis_.commanded() + pulses,
                {2.25 * pulses_per_motor_rev_, 100 * pulses_per_motor_rev_, 100 * pulses_per_motor_rev_});
}

}  // namespace scanrig::sim::wire
