#include "drivers/turntable/modbus_drive.h"

#include <array>
#include <vector>

namespace scanrig {
namespace {

constexpr int kAttempts = 3;

constexpr std::uint16_t high_word(std::uint32_t value) { return static_cast<std::uint16_t>(value >> 16); }
constexpr std::uint16_t low_word(std::uint32_t value) { return static_cast<std::uint16_t>(value & 0xFFFFu); }
std::int32_t from_words(const std::vector<std::uint16_t>& words) {
  return static_cast<std::int32_t>(std::uint32_t{words[0]} << 16 | words[1]);
}

std::uint16_t word_of(const DriveProfile::Move::Item& item, std::int32_t target, const DriveMotion& motion) {
  using Word = DriveProfile::Move::Word;
  switch (item.word) {
    case Word::constant: return item.value;
    case Word::position_high: return high_word(static_cast<std::uint32_t>(target));
    case Word::position_low: return low_word(static_cast<std::uint32_t>(target));
    case Word::speed_high: return high_word(motion.speed);
    case Word::speed: return low_word(motion.speed);
    case Word::acceleration_high: return high_word(motion.acceleration);
    case Word::acceleration: return low_word(motion.acceleration);
    case Word::deceleration_high: return high_word(motion.deceleration);
    case Word::deceleration: return low_word(motion.deceleration);
  }
  return 0;
}

}  // namespace

template <class Request>
auto ModbusDrive::repeat(const Request& request) -> decltype(request()) {
  auto answer = request();
  for (int attempt = 1; attempt < kAttempts && !answer; ++attempt) {
    if (!line_.answer_missed() || answer.error().code == ErrorCode::io) break;
    line_.count_retry();
    answer = request();
  }
  return answer;
}

Result<void> ModbusDrive::write(const DriveProfile::Trigger& trigger, Deadline deadline) {
  auto written = line_.write(trigger.address, trigger.value, deadline);
  if (!written || !trigger.release) return written;
  return line_.write(trigger.address, *trigger.release, deadline);
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
      state.homed = all_set(profile_.status.homed);
    }
    return state;
  });
}

Result<std::optional<int>> ModbusDrive::read_pulses_per_motor_rev(Deadline deadline) {
  if (!profile_.pulses_per_motor_rev_address) return std::nullopt;
  return repeat([&]() -> Result<std::optional<int>> {
    const auto words = line_.read(*profile_.pulses_per_motor_rev_address, 1, deadline);
    if (!words) return pass_on(words);
    return words->front();
  });
}

Result<std::string> ModbusDrive::read_alarm(Deadline deadline) {
  return repeat([&]() -> Result<std::string> {
    const auto words = line_.read(profile_.alarm.address, 1, deadline);
    if (!words) return pass_on(words);
    const std::uint16_t code = words->front();
    if (code == 0) return std::string();
    const auto known = profile_.alarm.words.find(code);
    if (known == profile_.alarm.words.end()) return fmt::format("alarm 0x{:02X}, not in {}", code, profile_.name);
    return fmt::format("{} (alarm 0x{:02X})", known->second, code);
  });
}

Result<void> ModbusDrive::enable(Deadline deadline) {
  if (!profile_.enable) return {};
  return repeat([&] { return write(*profile_.enable, deadline); });
}

Result<void> ModbusDrive::stop(Deadline deadline) {
  return repeat([&] { return write(profile_.stop, deadline); });
}

void ModbusDrive::stop_unheard() {
  if (line_.answer_missed()) std::ignore = line_.write_unheard(profile_.stop.address, profile_.stop.value);
}

Result<void> ModbusDrive::set_homing(const std::string& mode, const DriveMotion& fast, std::uint32_t slow_speed,
                                     Deadline deadline) {
  const auto& homing = profile_.homing;
  if (homing.mode_address) {
    const auto set = repeat([&] { return line_.write(*homing.mode_address, homing.modes.at(mode), deadline); });
    if (!set) return set;
  }
  if (!homing.speeds_address) return {};
  const std::array speeds{low_word(fast.speed), low_word(slow_speed), low_word(fast.acceleration),
                          low_word(fast.deceleration)};
  return repeat([&] { return line_.write(*homing.speeds_address, speeds, deadline); });
}

Result<void> ModbusDrive::set_soft_limits(const MovePlanner::Counter& range, Deadline deadline) {
  if (!profile_.soft_limits) return {};
  const auto& limits = *profile_.soft_limits;
  const auto word = [](double counter) { return static_cast<std::uint32_t>(static_cast<std::int32_t>(counter)); };
  const std::uint32_t plus = word(range.max), minus = word(range.min);
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
  return repeat([&] { return write(profile_.alarm.reset_trigger, deadline); });
}

Result<void> ModbusDrive::start_move(std::int32_t target, const DriveMotion& motion, Deadline deadline) {
  std::vector<std::uint16_t> words;
  for (const auto& item : profile_.move.words) words.push_back(word_of(item, target, motion));
  return line_.write(profile_.move.address, words, deadline);
}

}  // namespace scanrig
