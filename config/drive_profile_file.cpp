#include "config/drive_profile_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "config/section.h"
#include "core/files.h"

namespace scanrig::config {
namespace {

constexpr Range kWord{0, 0xFFFF};

void read_trigger(Section& section, std::string_view key, DriveProfile::Trigger& trigger) {
  section.section(key, [&](Section& s) {
    s.number("register", trigger.address, kWord);
    s.number("value", trigger.value, kWord);
    s.accept_old_name("momentary", "released");
    if (s.has("momentary")) s.flag("momentary", trigger.momentary);
  });
}

void read_optional(Section& s, std::string_view key, std::optional<std::uint16_t>& address) {
  if (!s.has(key)) return;
  address = 0;
  s.number(key, *address, kWord);
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

struct WordName {
  std::string_view name;
  DriveProfile::Block::Word word;
  bool high;
};

/// A 16-bit value, or either half of a 32-bit value.
const std::vector<WordName>& word_names() {
  using Word = DriveProfile::Block::Word;
  static const std::vector<WordName> names{{"position_high", Word::position, true},
                                           {"position_low", Word::position, false},
                                           {"speed", Word::speed, false},
                                           {"speed_high", Word::speed, true},
                                           {"speed_low", Word::speed, false},
                                           {"slow_speed", Word::slow_speed, false},
                                           {"acceleration", Word::acceleration, false},
                                           {"acceleration_high", Word::acceleration, true},
                                           {"acceleration_low", Word::acceleration, false},
                                           {"deceleration", Word::deceleration, false},
                                           {"deceleration_high", Word::deceleration, true},
                                           {"deceleration_low", Word::deceleration, false}};
  return names;
}

void read_block(Section& s, DriveProfile::Block& block) {
  s.number("register", block.address, kWord);
  s.items("words", [&](std::optional<std::int64_t> number, std::string_view name) {
    const auto found = std::ranges::find(word_names(), name, &WordName::name);
    if (number && *number >= 0 && *number <= 0xFFFF) {
      block.words.push_back({DriveProfile::Block::Word::constant, false, static_cast<std::uint16_t>(*number)});
    } else if (!number && found != word_names().end()) {
      block.words.push_back({found->word, found->high, 0});
    } else {
      s.report("words", fmt::format("{} is neither a word (0 to 0xFFFF) nor a known name",
                                    number ? std::to_string(*number) : fmt::format("\"{}\"", name)));
    }
  });
}

/// A move contains each value once: a position and a speed.
void read_move(Section& s, DriveProfile::Block& move) {
  using Word = DriveProfile::Block::Word;
  read_block(s, move);
  if (!s.sound()) return;
  const auto times = [&](Word word, bool high) {
    return std::ranges::count_if(move.words, [&](const auto& item) { return item.word == word && item.high == high; });
  };
  if (times(Word::position, true) != 1) s.report("words", "must contain \"position_high\" exactly once");
  if (times(Word::position, false) != 1) s.report("words", "must contain \"position_low\" exactly once");
  for (const auto& [word, name] : {std::pair(Word::speed, "speed"), std::pair(Word::acceleration, "acceleration"),
                                   std::pair(Word::deceleration, "deceleration")}) {
    if (times(word, false) != 1 || times(word, true) > 1) {
      s.report("words", fmt::format("must contain \"{0}\", or \"{0}_high\" and \"{0}_low\", exactly once", name));
    }
  }
  if (move.has(Word::acceleration, true) != move.has(Word::deceleration, true)) {
    s.report("words", "must hold acceleration and deceleration in the same number of bits");
  }
  if (move.has(Word::slow_speed, false)) s.report("words", "holds \"slow_speed\", which belongs to homing");
}

void read_homing(Section& s, DriveProfile::Homing& homing) {
  read_optional(s, "mode_register", homing.mode_address);
  s.section("modes", [&](Section& modes) {
    for (const std::string& mode : modes.free_keys()) modes.number(mode, homing.modes[mode], kWord);
  });
  if (s.has("absolute")) s.flag("absolute", homing.absolute);
  if (s.has("speeds"))
    s.section("speeds", [&](Section& speeds) { read_block(speeds, homing.speeds.emplace(DriveProfile::Block{})); });
  read_trigger(s, "start", homing.start);
  read_trigger(s, "set_zero", homing.set_zero);
}

void read_resolution(Section& s, DriveProfile::Resolution& resolution) {
  if (s.has("base")) s.number("base", resolution.base, {1, 65535});
  read_optional(s, "multiply_register", resolution.multiply_address);
  read_optional(s, "divide_register", resolution.divide_address);
  if (!resolution.multiply_address && !resolution.divide_address) {
    s.report("multiply_register", "is missing, and divide_register too: the resolution could not be checked");
  }
}

void read_soft_limits(Section& s, DriveProfile::SoftLimits& limits) {
  int bit = 0;
  s.number("control_register", limits.control_address, kWord);
  s.number("control_bit", bit, {0, 15});
  limits.control_mask = static_cast<std::uint16_t>(1u << bit);
  s.number("register", limits.address, kWord);
}

void read_status(Section& s, DriveProfile::Status& status) {
  s.number("register", status.address, kWord);
  read_bits(s, "fault", status.fault);
  if (s.has("enabled")) read_bits(s, "enabled", status.enabled);
  read_bits(s, "running", status.running);
  read_bits(s, "in_position", status.in_position);
  read_bits(s, "homed", status.homed);
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

/// A shorter one would trip on a line with faults. A longer one would stop only motions that end on their own anyway.
void read_communication_timeout(Section& s, DriveProfile::CommunicationTimeout& timeout) {
  s.number("register", timeout.address, kWord);
  s.number("timeout_ms", timeout.timeout, {500, 10'000});
}

}  // namespace

Result<DriveProfile> read_drive_profile(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  std::vector<std::string> warnings;
  return parse_drive_profile(*text, file, warnings);
}

Result<DriveProfile> parse_drive_profile(std::string_view text, const std::filesystem::path& file,
                                         std::vector<std::string>& warnings) {
  DriveProfile profile;
  using Speed = DriveProfile::SpeedUnit;
  using Acceleration = DriveProfile::AccelerationUnit;
  const auto read = read_toml(text, file, [&](Section& root) {
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
    root.section("pulses_per_motor_rev", [&](Section& s) { read_resolution(s, profile.pulses_per_motor_rev); });
    root.number("feedback_register", profile.feedback_address, kWord);
    if (root.has("enable")) read_trigger(root, "enable", profile.enable.emplace(DriveProfile::Trigger{}));
    read_trigger(root, "stop", profile.stop);
    root.section("move", [&](Section& s) { read_move(s, profile.move); });
    root.section("status", [&](Section& s) { read_status(s, profile.status); });
    root.section("homing", [&](Section& s) { read_homing(s, profile.homing); });
    if (root.has("soft_limits")) {
      root.section("soft_limits",
                   [&](Section& s) { read_soft_limits(s, profile.soft_limits.emplace(DriveProfile::SoftLimits{})); });
    }
    root.section("alarm", [&](Section& s) { read_alarm(s, profile.alarm); });
    if (root.has("communication_timeout")) {
      root.section("communication_timeout", [&](Section& s) {
        read_communication_timeout(s, profile.communication_timeout.emplace(DriveProfile::CommunicationTimeout{}));
      });
    }
  });
  if (!read) return pass_on(read);
  warnings.insert(warnings.end(), read->begin(), read->end());
  return profile;
}

}  // namespace scanrig::config
