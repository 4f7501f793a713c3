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
    if (s.has("release")) s.number("release", trigger.release.emplace(), kWord);
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
  mask = static_cast<std::uint16_t>(bits);
}

void read_move(Section& s, DriveProfile::Move& move) {
  using Word = DriveProfile::Move::Word;
  static const std::vector<Choice<Word>> kWords{{"position_high", Word::position_high},
                                                {"position_low", Word::position_low},
                                                {"speed", Word::speed},
                                                {"acceleration", Word::acceleration},
                                                {"deceleration", Word::deceleration}};
  static const std::vector<Choice<Word>> kHighWords{{"speed_high", Word::speed_high},
                                                    {"acceleration_high", Word::acceleration_high},
                                                    {"deceleration_high", Word::deceleration_high}};
  s.number("register", move.address, kWord);
  s.items("words", [&](std::optional<std::int64_t> number, std::string_view name) {
    const auto known = [&](const std::vector<Choice<Word>>& words) {
      const auto found = std::ranges::find(words, name, &Choice<Word>::name);
      return found == words.end() ? std::nullopt : std::optional(found->value);
    };
    const auto word = known(kWords) ? known(kWords) : known(kHighWords);
    if (number && *number >= 0 && *number <= 0xFFFF) {
      move.words.push_back({Word::constant, static_cast<std::uint16_t>(*number)});
    } else if (!number && word) {
      move.words.push_back({*word, 0});
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
  for (const auto& word : kHighWords) {
    if (std::ranges::count(move.words, word.value, &DriveProfile::Move::Item::word) > 1) {
      s.report("words", fmt::format("must contain \"{}\" at most once", word.name));
    }
  }
}

void read_homing(Section& s, DriveProfile::Homing& homing) {
  if (s.has("mode_register")) s.number("mode_register", homing.mode_address.emplace(), kWord);
  s.section("modes", [&](Section& modes) {
    for (const std::string& mode : modes.free_keys()) modes.number(mode, homing.modes[mode], kWord);
  });
  if (s.has("speeds_register")) s.number("speeds_register", homing.speeds_address.emplace(), kWord);
  if (s.has("zero_is_known")) s.flag("zero_is_known", homing.zero_is_known);
  read_trigger(s, "start", homing.start);
  if (s.has("set_zero")) read_trigger(s, "set_zero", homing.set_zero.emplace());
}

void read_soft_limits(Section& s, DriveProfile::SoftLimits& limits) {
  int bit = 0;
  s.number("control_register", limits.control_address, kWord);
  s.number("control_bit", bit, {0, 15});
  limits.control_mask = static_cast<std::uint16_t>(1u << bit);
  s.number("register", limits.address, kWord);
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
    if (root.has("pulses_per_motor_rev_register")) {
      root.number("pulses_per_motor_rev_register", profile.pulses_per_motor_rev_address.emplace(), kWord);
    }
    root.number("feedback_register", profile.feedback_address, kWord);
    if (root.has("enable")) read_trigger(root, "enable", profile.enable.emplace());
    read_trigger(root, "stop", profile.stop);
    root.section("move", [&](Section& s) { read_move(s, profile.move); });
    root.section("status", [&](Section& s) {
      s.number("register", profile.status.address, kWord);
      read_bits(s, "fault", profile.status.fault);
      read_bits(s, "enabled", profile.status.enabled);
      read_bits(s, "running", profile.status.running);
      read_bits(s, "in_position", profile.status.in_position);
      read_bits(s, "homed", profile.status.homed);
      if (s.has("homed_stays")) s.flag("homed_stays", profile.status.homed_stays);
      if (profile.status.fault == 0) s.report("fault", "must name at least one bit");
      if (profile.status.running == 0) s.report("running", "must name at least one bit");
    });
    root.section("homing", [&](Section& s) { read_homing(s, profile.homing); });
    if (root.has("soft_limits")) {
      root.section("soft_limits", [&](Section& s) { read_soft_limits(s, profile.soft_limits.emplace()); });
    }
    root.section("alarm", [&](Section& s) { read_alarm(s, profile.alarm); });
  });
  if (!read) return pass_on(read);
  return profile;
}

}  // namespace scanrig::config
