#include "config/drive_profile_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "config/section.h"

namespace scanrig::config {
namespace {

constexpr Range kWord{0, 0xFFFF};

void read_trigger(Section& section, std::string_view key, DriveProfile::Trigger& trigger) {
  section.section(key, [&](Section& s) {
    s.number("register", trigger.address, kWord);
    s.number("value", trigger.value, kWord);
  });
}

void read_bits(Section& section, std::string_view key, std::uint16_t& mask) {
  unsigned bits = 0;
  section.items(key, [&](std::optional<std::int64_t> bit, std::string_view) {
    if (bit && *bit >= 0 && *bit <= 15) {
      bits |= 1u << *bit;
    } else {
      section.report(key, "holds a bit that is not between 0 and 15");
    }
  });
  if (bits == 0) section.report(key, "must name at least one bit");
  mask = static_cast<std::uint16_t>(bits);
}

void read_move(Section& s, DriveProfile::Move& move) {
  using Word = DriveProfile::Move::Word;
  static const std::vector<Choice<Word>> kWords{{"position_high", Word::position_high},
                                                {"position_low", Word::position_low},
                                                {"speed", Word::speed},
                                                {"acceleration", Word::acceleration},
                                                {"deceleration", Word::deceleration}};
  s.number("register", move.address, kWord);
  s.items("words", [&](std::optional<std::int64_t> number, std::string_view name) {
    const auto found = std::ranges::find(kWords, name, &Choice<Word>::name);
    if (number && *number >= 0 && *number <= 0xFFFF) {
      move.words.push_back({Word::constant, static_cast<std::uint16_t>(*number)});
    } else if (!number && found != kWords.end()) {
      move.words.push_back({found->value, 0});
    } else {
      s.report("words", fmt::format("{} is neither a word (0 to 0xFFFF) nor a known name",
                                    number ? std::to_string(*number) : fmt::format("\"{}\"", name)));
    }
  });
  for (const auto& word : kWords) {
    if (std::ranges::count(move.words, word.value, &DriveProfile::Move::Item::word) != 1) {
      s.report("words", fmt::format("must contain \"{}\" exactly once", word.name));
    }
  }
}

void read_homing(Section& s, DriveProfile::Homing& homing) {
  s.number("mode_register", homing.mode_address, kWord);
  s.section("modes", [&](Section& modes) {
    for (const std::string& mode : modes.free_keys()) modes.number(mode, homing.modes[mode], kWord);
  });
  s.number("speeds_register", homing.speeds_address, kWord);
  read_trigger(s, "start", homing.start);
  read_trigger(s, "set_zero", homing.set_zero);
}

void read_alarm(Section& s, DriveProfile::Alarm& alarm) {
  using Reset = DriveProfile::Alarm::Reset;
  s.number("register", alarm.address, kWord);
  s.choice<Reset>("reset", alarm.reset, {{"register", Reset::by_register}, {"power_cycle", Reset::power_cycle}});
  if (alarm.reset == Reset::by_register) read_trigger(s, "reset_trigger", alarm.reset_trigger);
  s.section("words", [&](Section& words) {
    for (const std::string& key : words.free_keys()) {
      std::uint16_t code = 0;
      const char* const end = key.data() + key.size();
      const bool hexadecimal = key.starts_with("0x") && key.size() > 2;
      const auto parsed = std::from_chars(key.data() + (hexadecimal ? 2 : 0), end, code, hexadecimal ? 16 : 10);
      if (parsed.ec != std::errc() || parsed.ptr != end) words.report(key, "is not an alarm code, such as 0x40");
      words.text(key, alarm.words[code]);
    }
  });
}

}  // namespace

Result<DriveProfile> read_drive_profile(const std::filesystem::path& file) {
  DriveProfile profile;
  using Speed = DriveProfile::SpeedUnit;
  using Acceleration = DriveProfile::AccelerationUnit;
  const auto read = read_toml(file, [&](Section& root) {
    int schema = 0;
    root.one_of("schema", schema, {1});
    root.text("name", profile.name);
    root.text("models", profile.models);
    root.section("unit_id", [&](Section& s) {
      s.number("min", profile.min_unit_id, {1, 247});
      s.number("max", profile.max_unit_id, {1, 247});
    });
    root.number("max_motor_rpm", profile.max_motor_rpm, {1, 20000});
    root.choice<Speed>("speed_unit", profile.speed_unit, {{"rpm", Speed::rpm}, {"pulses_per_s", Speed::pulses_per_s}});
    root.choice<Acceleration>(
        "acceleration_unit", profile.acceleration_unit,
        {{"ms_per_1000_rpm", Acceleration::ms_per_1000_rpm}, {"pulses_per_s2", Acceleration::pulses_per_s2}});
    root.number("pulses_per_motor_rev_register", profile.pulses_per_motor_rev_address, kWord);
    root.number("feedback_register", profile.feedback_address, kWord);
    read_trigger(root, "enable", profile.enable);
    read_trigger(root, "stop", profile.stop);
    root.section("move", [&](Section& s) { read_move(s, profile.move); });
    root.section("status", [&](Section& s) {
      s.number("register", profile.status.address, kWord);
      read_bits(s, "fault", profile.status.fault);
      read_bits(s, "enabled", profile.status.enabled);
      read_bits(s, "running", profile.status.running);
      read_bits(s, "in_position", profile.status.in_position);
      read_bits(s, "homed", profile.status.homed);
    });
    root.section("homing", [&](Section& s) { read_homing(s, profile.homing); });
    root.section("soft_limits", [&](Section& s) {
      int bit = 0;
      s.number("control_register", profile.soft_limits.control_address, kWord);
      s.number("control_bit", bit, {0, 15});
      profile.soft_limits.control_mask = static_cast<std::uint16_t>(1u << bit);
      s.number("register", profile.soft_limits.address, kWord);
    });
    root.section("alarm", [&](Section& s) { read_alarm(s, profile.alarm); });
  });
  if (!read) return pass_on(read);
  return profile;
}

}  // namespace scanrig::config
