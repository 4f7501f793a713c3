#include "config/turntable_section.h"

#include <fmt/ranges.h>

#include "config/drive_profile_file.h"
#include "core/files.h"

namespace scanrig::config {
namespace {

/// A tolerance of fewer pulses cannot be distinguished from the drive's own rounding.
constexpr double kMinTolerancePulses = 2.0;

void read_profile(Section& s, const std::vector<std::filesystem::path>& folders, TurntableConfig& turntable) {
  std::string name;
  s.text("profile", name);
  if (name.empty()) return;
  if (name.find('/') != std::string::npos) return s.report("profile", "must be a name, not a path");
  std::vector<std::string> tried;
  for (const auto& folder : folders) {
    const auto file = folder / (name + ".toml");
    auto text = read_file(file);
    if (!text && text.error().code == ErrorCode::not_found) {
      tried.push_back(file.string());
      continue;
    }
    std::vector<std::string> warnings;
    const auto profile = text ? parse_drive_profile(*text, file, warnings) : pass_on(text);
    if (!profile) return s.report("profile", profile.error().message);
    for (const auto& warning : warnings) s.warn("profile", warning);
    turntable.modbus.profile = *profile;
    turntable.profile_file = SourceFile{file.filename(), std::move(*text)};
    return;
  }
  s.report("profile", fmt::format("there is none of {}", fmt::join(tried, ", ")));
}

void check_against_profile(Section& s, const ModbusTurntableOptions& options) {
  const auto& profile = options.profile;
  if (options.line.unit_id < profile.min_unit_id || options.line.unit_id > profile.max_unit_id) {
    s.report("unit_id", fmt::format("{} is not between {} and {}, as {} allows", options.line.unit_id,
                                    profile.min_unit_id, profile.max_unit_id, profile.name));
  }
  if (auto word = options.scale.speed_word(options.speed, profile); !word)
    s.report("speed_deg_s", word.error().message);
  if (auto word = options.scale.acceleration_word(options.acceleration, profile); !word) {
    s.report("acceleration_deg_s2", word.error().message);
  }
}

/// Three attempts at a request and the silence between them: meanwhile a drive must not stop on its own.
constexpr int kReplyTimeouts = 20;

void check_reply_timeout(Section& s, const ModbusTurntableOptions& options) {
  const auto& drive = options.profile.communication_timeout;
  if (!drive || kReplyTimeouts * options.line.reply_timeout <= drive->timeout) return;
  s.report("reply_timeout_ms",
           fmt::format("{} is too long for {}, which stops after {} ms without a request; at most {} ms",
                       options.line.reply_timeout.count(), options.profile.name, drive->timeout.count(),
                       drive->timeout.count() / kReplyTimeouts));
}

void check_tolerance(Section& s, const AxisTurntableOptions& options) {
  if (options.tolerance.value * options.scale.pulses_per_degree() >= kMinTolerancePulses) return;
  s.report("tolerance_deg",
           fmt::format("{} is less than {} pulses of the motor; at least {:.4f} is possible", options.tolerance.value,
                       kMinTolerancePulses, kMinTolerancePulses / options.scale.pulses_per_degree()));
}

void read_soft_limits(Section& s, std::optional<AngleRange>& limits) {
  if (!s.has("soft_limits")) return;
  AngleRange range;
  s.section("soft_limits", [&](Section& inner) {
    inner.number("min_deg", range.min.value, {-36000, 36000});
    inner.number("max_deg", range.max.value, {-36000, 36000});
    if (range.max <= range.min) inner.report("max_deg", "must be more than min_deg");
  });
  limits = range;
}

/// Motion settings, for every driver. `modes`: how the drive can home; empty if unknown.
void read_motion(Section& s, const std::vector<std::string>& modes, AxisTurntableOptions& options) {
  s.number("gear_ratio", options.scale.gear_ratio, {0.1, 1000});
  s.choice<bool>("positive", options.scale.positive_ccw, {{"ccw", true}, {"cw", false}});
  s.section("home", [&](Section& home) {
    std::vector<Choice<std::string>> choices{{"here", "here"}};
    for (const auto& mode : modes) choices.push_back({mode, mode});
    if (modes.empty()) {
      home.text("mode", options.home_mode);
    } else {
      home.choice("mode", options.home_mode, choices);
    }
    home.number("offset_deg", options.scale.home_offset.value, {-360, 360});
  });
  s.number("speed_deg_s", options.speed.value, {0.1, 360});
  s.number("acceleration_deg_s2", options.acceleration.value, {0.1, 3600});
  s.number("backlash_deg", options.backlash.value, {0, 10});
  s.number("tolerance_deg", options.tolerance.value, {0.0001, 1});
  s.number("settle_ms", options.settle, {0, 10000});
  read_soft_limits(s, options.soft_limits);
}

void read_modbus(Section& s, const std::vector<std::filesystem::path>& drive_folders, TurntableConfig& turntable) {
  auto& options = turntable.modbus;
  read_profile(s, drive_folders, turntable);
  read_modbus_line(s, options.line);
  s.number("pulses_per_motor_rev", options.scale.pulses_per_motor_rev, {200, 65535});
  std::vector<std::string> modes;
  for (const auto& [mode, value] : options.profile.homing.modes) modes.push_back(mode);
  read_motion(s, modes, options);
  if (!s.sound()) return;
  check_against_profile(s, options);
  check_reply_timeout(s, options);
  check_tolerance(s, options);
}

/// A controller's unit is one degree of its motor, or with gear_ratio = 1 one degree of the table.
void read_grbl(Section& s, GrblTurntableOptions& options) {
  auto& link = options.drive.link;
  s.text("device", link.device);
  s.one_of("baud", link.baud, {9600, 19200, 38400, 57600, 115200, 230400});
  s.number("reply_timeout_ms", link.reply_timeout, {10, 2000});
  if (s.has("axis")) {
    s.choice<char>("axis", options.drive.axis,
                   {{"X", 'X'}, {"Y", 'Y'}, {"Z", 'Z'}, {"A", 'A'}, {"B", 'B'}, {"C", 'C'}});
  }
  read_motion(s, {"switch"}, options);
  options.scale.pulses_per_motor_rev = GrblDrive::kPulsesPerMotorRev;
  if (s.sound()) check_tolerance(s, options);
}

}  // namespace

void read_modbus_line(Section& s, modbus::ClientOptions& line) {
  using modbus::Parity;
  s.text("device", line.device);
  s.one_of("baud", line.baud, {9600, 19200, 38400, 57600, 115200});
  s.choice<Parity>("parity", line.parity, {{"none", Parity::none}, {"even", Parity::even}, {"odd", Parity::odd}});
  s.number("unit_id", line.unit_id, {1, 247});
  s.number("reply_timeout_ms", line.reply_timeout, {10, 2000});
  if (!s.has("rs485")) return;
  s.section("rs485", [&](Section& direction) {
    auto& rs485 = line.rs485.emplace();
    direction.choice<bool>("rts", rs485.high_while_sending, {{"high", true}, {"low", false}});
    if (direction.has("before_ms")) direction.number("before_ms", rs485.before, {0, 100});
    if (direction.has("after_ms")) direction.number("after_ms", rs485.after, {0, 100});
  });
}

void read_turntable(Section& s, const std::vector<std::filesystem::path>& drive_folders, TurntableConfig& turntable) {
  using Driver = TurntableConfig::Driver;
  s.choice<Driver>("driver", turntable.driver, {{"modbus", Driver::modbus}, {"grbl", Driver::grbl}});
  turntable.driver == Driver::grbl ? read_grbl(s, turntable.grbl) : read_modbus(s, drive_folders, turntable);
}

}  // namespace scanrig::config
