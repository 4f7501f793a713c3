#include "drivers/turntable/modbus_drive.h"

#include <array>
#include <vector>

namespace scanrig {
namespace {

constexpr int kAttempts = 3;
/// Largest communication time-out: a register that holds more is a different register.
constexpr std::uint16_t kMaxCommunicationTimeoutMs = 10'000;

constexpr std::uint16_t high_word(std::int32_t value) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) >> 16);
}
constexpr std::uint16_t low_word(std::int32_t value) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) & 0xFFFFu);
}
std::int32_t from_words(const std::vector<std::uint16_t>& words) {
  return static_cast<std::int32_t>(std::uint32_t{words[0]} << 16 | words[1]);
}

std::uint16_t word_of(const DriveProfile::Block::Item& item, std::int32_t target, const DriveMotion& motion) {
  using Word = DriveProfile::Block::Word;
  const auto half = [&](std::uint32_t value) {
    return item.high ? high_word(static_cast<std::int32_t>(value)) : low_word(static_cast<std::int32_t>(value));
  };
  switch (item.word) {
    case Word::constant: return item.value;
    case Word::position: return half(static_cast<std::uint32_t>(target));
    case Word::speed: return half(motion.speed);
    case Word::slow_speed: return half(motion.slow_speed);
    case Word::acceleration: return half(motion.acceleration);
    case Word::deceleration: return half(motion.deceleration);
  }
  return 0;
}

}  // namespace

template <class Request>
auto ModbusDrive::repeat(const Request& request) -> decltype(request()) {
  auto answer = request();
  for (int attempt = 1; attempt < kAttempts && !answer; ++attempt) {
    if (!line_.reply_missed() || answer.error().code == ErrorCode::io) break;
    line_.count_retry();
    answer = request();
  }
  return answer;
}

Result<DriveState> ModbusDrive::read_state(Deadline deadline) {
  bool status_first = false;
  return repeat([&]() -> Result<DriveState> {
    status_first = !status_first;
    DriveState state;
    for (const bool status : {status_first, !status_first}) {
      const auto words =
          line_.read(status ? profile_.status.address : profile_.feedback_address, status ? 1 : 2, deadline);
      if (!words) {
        // The repetition starts with the other request.
        status_first = status;
        return pass_on(words);
      }
      if (!status) {
        state.position = from_words(*words);
        continue;
      }
      const auto all_set = [&](std::uint16_t mask) { return (words->front() & mask) == mask; };
      state.fault = all_set(profile_.status.fault);
      state.enabled = all_set(profile_.status.enabled);
      state.running = all_set(profile_.status.running);
      state.in_position = all_set(profile_.status.in_position);
      homed_ = all_set(profile_.status.homed) || (profile_.homing.absolute && homed_);
      state.homed = homed_;
    }
    return state;
  });
}

Result<int> ModbusDrive::read_pulses_per_motor_rev(Deadline deadline) {
  const auto& resolution = profile_.pulses_per_motor_rev;
  const auto factor = [&](const std::optional<std::uint16_t>& address) -> Result<int> {
    if (!address) return 1;
    return repeat([&]() -> Result<int> {
      const auto words = line_.read(*address, 1, deadline);
      if (!words) return pass_on(words);
      return words->front();
    });
  };
  const auto times = factor(resolution.multiply_address);
  if (!times) return times;
  const auto by = factor(resolution.divide_address);
  if (!by) return by;
  if (*by == 0) return fail(ErrorCode::protocol, "{}: its electronic gear divides by 0", profile_.name);
  return resolution.base * *times / *by;
}

Result<std::string> ModbusDrive::read_alarm(Deadline deadline) {
  return repeat([&]() -> Result<std::string> {
    const auto words = line_.read(profile_.alarm.address, 1, deadline);
    if (!words) return pass_on(words);
    const std::uint16_t code = words->front();
    if (code == 0) return std::string();
    const auto known = profile_.alarm.words.find(code);
    if (known == profile_.alarm.words.end()) {
      return fmt::format("alarm 0x{:02X}, which the profile {} does not know: see the drive's manual", code,
                         profile_.name);
    }
    return fmt::format("{} (alarm 0x{:02X})", known->second, code);
  });
}

Result<void> ModbusDrive::write(const DriveProfile::Trigger& trigger, Deadline deadline) {
  if (trigger.momentary) to_release_ = trigger.address;
  return line_.write(trigger.address, trigger.value, deadline);
}

/// Resets a trigger that is still set: the drive acts on the edge, and would not detect the next one.
Result<void> ModbusDrive::release(Deadline deadline) {
  if (!to_release_) return {};
  const auto momentary = repeat([&] { return line_.write(*to_release_, 0, deadline); });
  if (momentary) to_release_.reset();
  return momentary;
}

Result<void> ModbusDrive::pull(const DriveProfile::Trigger& trigger, Deadline deadline) {
  if (auto free = release(deadline); !free) return free;
  if (auto written = write(trigger, deadline); !written) return written;
  return release(deadline);
}

Result<void> ModbusDrive::write(const DriveProfile::Block& block, std::int32_t target, const DriveMotion& motion,
                                Deadline deadline) {
  std::vector<std::uint16_t> words;
  for (const auto& item : block.words) words.push_back(word_of(item, target, motion));
  return line_.write(block.address, words, deadline);
}

Result<void> ModbusDrive::enable(Deadline deadline) {
  if (!profile_.enable) return {};
  return repeat([&] { return write(*profile_.enable, deadline); });
}

Result<std::uint16_t> ModbusDrive::read_communication_timeout(Deadline deadline) {
  return repeat([&]() -> Result<std::uint16_t> {
    const auto words = line_.read(profile_.communication_timeout->address, 1, deadline);
    if (!words) return pass_on(words);
    return words->front();
  });
}

Result<void> ModbusDrive::guard_connection(bool on, Deadline deadline) {
  if (!profile_.communication_timeout) return {};
  const std::uint16_t address = profile_.communication_timeout->address;
  if (!is_timeout_seen_) {
    const auto before = read_communication_timeout(deadline);
    if (!before) return pass_on(before);
    if (*before > kMaxCommunicationTimeoutMs) {
      return fail(ErrorCode::protocol, "register 0x{:04X} holds {}, not a communication time-out; check the profile {}",
                  address, *before, profile_.name);
    }
    is_timeout_seen_ = true;
  }
  const auto wanted =
      on ? static_cast<std::uint16_t>(profile_.communication_timeout->timeout.count()) : std::uint16_t{0};
  if (auto written = repeat([&] { return line_.write(address, wanted, deadline); }); !written) return written;
  const auto now = read_communication_timeout(deadline);
  if (!now) return pass_on(now);
  if (*now == wanted) return {};
  return fail(ErrorCode::protocol, "the drive does not take a communication time-out of {} ms, it has {} ms", wanted,
              *now);
}

Result<void> ModbusDrive::stop(Deadline deadline) {
  // A trigger that is still set waits: the stop comes first.
  if (auto told = repeat([&] { return write(profile_.stop, deadline); }); !told) return told;
  return release(deadline);
}

void ModbusDrive::stop_without_reply() {
  if (!line_.reply_missed()) return;
  if (profile_.stop.momentary) to_release_ = profile_.stop.address;
  std::ignore = line_.write_without_reply(profile_.stop.address, profile_.stop.value);
}

Result<void> ModbusDrive::set_homing(const std::string& mode, const DriveMotion& motion, Deadline deadline) {
  const auto& homing = profile_.homing;
  if (homing.mode_address) {
    const auto set = repeat([&] { return line_.write(*homing.mode_address, homing.modes.at(mode), deadline); });
    if (!set) return set;
  }
  if (!homing.speeds) return {};
  return repeat([&] { return write(*homing.speeds, 0, motion, deadline); });
}

Result<void> ModbusDrive::set_soft_limits(const MovePlanner::Counter& range, Deadline deadline) {
  if (!profile_.soft_limits) return {};
  const auto& limits = *profile_.soft_limits;
  const auto plus = static_cast<std::int32_t>(range.max), minus = static_cast<std::int32_t>(range.min);
  const std::array<std::uint16_t, 4> words{high_word(plus), low_word(plus), high_word(minus), low_word(minus)};
  if (auto written = repeat([&] { return line_.write(limits.address, words, deadline); }); !written) return written;
  const auto control = repeat([&] { return line_.read(limits.control_address, 1, deadline); });
  if (!control) return pass_on(control);
  const auto with_limits = static_cast<std::uint16_t>(control->front() | limits.control_mask);
  return repeat([&] { return line_.write(limits.control_address, with_limits, deadline); });
}

Result<void> ModbusDrive::reset_alarm(Deadline deadline) {
  if (profile_.alarm.reset == DriveProfile::Alarm::Reset::power_cycle) {
    return fail(ErrorCode::device_alarm, "{} clears an alarm only when switched off and on again", profile_.name);
  }
  return repeat([&] { return pull(profile_.alarm.reset_trigger, deadline); });
}

Result<void> ModbusDrive::start_homing(Deadline deadline) {
  homed_ = false;
  return pull(profile_.homing.start, deadline);
}

Result<void> ModbusDrive::set_zero(Deadline deadline) {
  homed_ = false;
  return pull(profile_.homing.set_zero, deadline);
}

Result<void> ModbusDrive::start_move(std::int32_t target, const DriveMotion& motion, Deadline deadline) {
  if (auto free = release(deadline); !free) return free;
  return write(profile_.move, target, motion, deadline);
}

}  // namespace scanrig
