#include "config/rig_toml.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <utility>
#include <vector>

namespace scanrig::config {
namespace {

constexpr std::size_t kCommentColumn = 40;

std::string quoted(const std::string& text) {
  const toml::value value(text);
  std::ostringstream out;
  out << toml::toml_formatter(value, toml::format_flags::none);
  return out.str();
}

std::string_view word(modbus::Parity parity) {
  switch (parity) {
    case modbus::Parity::none: return "none";
    case modbus::Parity::even: return "even";
    case modbus::Parity::odd: break;
  }
  return "odd";
}

std::string_view word(gpio::Bias bias) {
  switch (bias) {
    case gpio::Bias::disabled: return "disabled";
    case gpio::Bias::pull_up: return "pull-up";
    case gpio::Bias::pull_down: return "pull-down";
    case gpio::Bias::as_is: break;
  }
  return "as-is";
}

/// Lines of `key = value`, with comments in one column.
class Table {
 public:
  explicit Table(std::string_view name) : text_(fmt::format("\n[{}]\n", name)) {}

  void add(std::string_view key, const std::string& value, std::string_view comment = "") {
    auto line = fmt::format("{} = {}", key, value);
    if (!comment.empty()) {
      line.resize(std::max(line.size() + 1, kCommentColumn), ' ');
      line += fmt::format("# {}", comment);
    }
    text_ += line + "\n";
  }
  void text(std::string_view key, const std::string& value, std::string_view comment = "") {
    add(key, quoted(value), comment);
  }
  template <class Number>
  void number(std::string_view key, Number value, std::string_view comment = "") {
    add(key, fmt::format("{}", value), comment);
  }
  void pin(std::string_view key, const Pin& pin, bool by_channel, std::string_view comment = "") {
    std::string inner;
    if (by_channel) {
      inner = fmt::format("channel = {}", pin.channel);
    } else if (pin.line.empty()) {
      inner = fmt::format("chip = {}, offset = {}", quoted(pin.chip), pin.offset);
    } else {
      inner = fmt::format("line = {}", quoted(pin.line));
    }
    if (pin.active_low) inner += ", active = \"low\"";
    if (pin.bias != gpio::Bias::as_is) inner += fmt::format(", bias = \"{}\"", word(pin.bias));
    add(key, "{ " + inner + " }", comment);
  }
  void port(const std::string& device, int baud) {
    text("device", device);
    number("baud", baud);
  }
  void modbus_line(const modbus::ClientOptions& line) {
    port(line.device, line.baud);
    add("parity", fmt::format("\"{}\"", word(line.parity)));
    number("unit_id", line.unit_id);
    number("reply_timeout_ms", line.reply_timeout.count());
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string safety(const RigConfig& rig) {
  const bool by_channel = rig.panel.driver == PanelConfig::Driver::modbus_io;
  Table t("safety");
  t.pin("estop", rig.safety.estop, by_channel, "read only: the relay does the work");
  if (rig.safety.guard) t.pin("guard", *rig.safety.guard, by_channel);
  const bool guarded = rig.safety.home_after_restart == SafetyConfig::HomeAfterRestart::guarded;
  t.text("home_after_restart", guarded ? "guarded" : "on_reset", "on_reset | guarded");
  t.add("remote_start", rig.safety.remote_start ? "true" : "false", "true: the page may start; needs a guard");
  return t.text();
}

std::string turntable(const TurntableConfig& turntable) {
  Table t("turntable");
  const AxisTurntableOptions& motion = turntable.motion();
  if (turntable.driver == TurntableConfig::Driver::grbl) {
    const auto& link = turntable.grbl.drive.link;
    t.text("driver", "grbl");
    t.port(link.device, link.baud);
    t.number("reply_timeout_ms", link.reply_timeout.count());
  } else {
    const auto profile = turntable.profile_file ? std::filesystem::path(turntable.profile_file->name) : "";
    t.text("driver", "modbus");
    t.text("profile", profile.stem().string(), "a file in drives/");
    t.modbus_line(turntable.modbus.line);
    t.number("pulses_per_motor_rev", motion.scale.pulses_per_motor_rev, "as the drive is set");
  }
  t.number("gear_ratio", motion.scale.gear_ratio, "motor turns per table turn");
  t.text("positive", motion.scale.positive_ccw ? "ccw" : "cw", "direction of positive pulses, seen from above");
  t.add("home",
        fmt::format("{{ mode = {}, offset_deg = {} }}", quoted(motion.home_mode), motion.scale.home_offset.value));
  t.number("speed_deg_s", motion.speed.value);
  t.number("acceleration_deg_s2", motion.acceleration.value);
  t.number("backlash_deg", motion.backlash.value, "every angle is approached from the same side");
  t.number("tolerance_deg", motion.tolerance.value, "at the table");
  t.number("settle_ms", motion.settle.count());
  return t.text();
}

void add_lightcrafter(Table& t, const ProjectorConfig& projector) {
  const LightCrafterOptions& options = projector.lightcrafter;
  t.text("driver", "lightcrafter4500");
  if (!projector.serial.empty()) t.text("serial", projector.serial);
  t.number("image", options.image, "with the pattern: index of the image in its flash");
  t.number("pattern", options.pattern, "bit plane of that image");
  t.number("depth_bits", options.depth);
  t.add("led_current", fmt::format("{{ red = {}, green = {}, blue = {} }}", options.led_current[0],
                                   options.led_current[1], options.led_current[2]));
  t.number("exposure_us", options.exposure.count(), "of the light, at least the cameras'");
  t.number("reply_timeout_ms", options.reply_timeout.count());
}

std::string projector(const ProjectorConfig& projector) {
  using Driver = ProjectorConfig::Driver;
  Table t("projector");
  switch (projector.driver) {
    case Driver::gpio:
      t.text("driver", "gpio");
      t.text("line", projector.line.line, "the pattern; also wired to both cameras' trigger input");
      if (projector.plain_line) t.text("plain_line", projector.plain_line->line, "plain light");
      t.number("pulse_us", projector.pulse.count(), "at least exposure_us of [stereo_camera]");
      break;
    case Driver::modbus_io:
      t.text("driver", "modbus-io");
      t.number("channel", projector.line.channel, "the pattern; also wired to both cameras' trigger input");
      if (projector.plain_line) t.number("plain_channel", projector.plain_line->channel, "plain light");
      t.number("pulse_us", projector.pulse.count(), "timed over the bus: some 10 ms longer");
      break;
    case Driver::lightcrafter4500: add_lightcrafter(t, projector); break;
    case Driver::camera_strobe:
      t.text("driver", "camera-strobe");
      t.text("line", projector.line.line, "output of the left camera: the pattern, and the right camera's trigger");
      if (projector.plain_line) t.text("plain_line", projector.plain_line->line, "plain light");
      break;
    case Driver::manual: t.text("driver", "manual"); break;
  }
  t.number("warm_up_s", projector.warm_up.count(), "no job starts automatically before; Start does not wait");
  return t.text();
}

std::string camera_table(const AravisSensorOptions& camera) {
  if (camera.address.empty()) return fmt::format("{{ serial = {} }}", quoted(camera.serial));
  return fmt::format("{{ serial = {}, address = {} }}", quoted(camera.serial), quoted(camera.address));
}

void add_pattern_exposures(Table& t, const StereoCameraConfig& camera) {
  std::vector<long> us;
  for (const auto exposure : camera.pattern_exposures) us.push_back(exposure.count());
  if (!us.empty()) t.add("pattern_exposures_us", fmt::format("[{}]", fmt::join(us, ", ")));
}

void add_v4l2(Table& t, const StereoCameraConfig& camera) {
  const V4l2Options& v4l2 = camera.v4l2;
  const auto sensor = [](const V4l2SensorOptions& options) {
    return options.serial.empty() ? fmt::format("{{ device = {} }}", quoted(options.device))
                                  : fmt::format("{{ serial = {} }}", quoted(options.serial));
  };
  t.text("driver", v4l2.right ? "v4l2" : "v4l2-side-by-side");
  t.add(v4l2.right ? "left" : "both", sensor(v4l2.left));
  if (v4l2.right) t.add("right", sensor(*v4l2.right));
  t.add("external_trigger", v4l2.external_trigger ? "true" : "false");
  t.text("pixel_format", v4l2.pixel_format);
  t.add("size", fmt::format("{{ width = {}, height = {} }}", v4l2.size.width, v4l2.size.height));
  t.number("exposure_us", camera.exposure.count(), "set it with the page's focus aid");
  add_pattern_exposures(t, camera);
  t.number("frame_timeout_ms", v4l2.frame_timeout.count());
}

std::string stereo_camera(const StereoCameraConfig& camera) {
  Table t("stereo_camera");
  if (camera.driver == StereoCameraConfig::Driver::aravis) {
    const AravisOptions& aravis = camera.aravis;
    t.text("driver", "aravis");
    t.add("left", camera_table(aravis.left));
    t.add("right", camera_table(aravis.right));
    t.add("trigger", fmt::format("{{ source = {}, edge = \"{}\" }}", quoted(aravis.trigger_source),
                                 aravis.falling_edge ? "falling" : "rising"));
    t.text("pixel_format", aravis.pixel_format);
    t.number("exposure_us", camera.exposure.count(), "set it with the page's focus aid");
    add_pattern_exposures(t, camera);
    t.number("frame_timeout_ms", aravis.frame_timeout.count());
    t.text("clock", aravis.frame_clock == TriggeringOptions::FrameClock::ptp ? "ptp" : "interval", "interval | ptp");
    return t.text();
  }
  add_v4l2(t, camera);
  return t.text();
}

std::string panel(const PanelConfig& panel) {
  const bool by_channel = panel.driver == PanelConfig::Driver::modbus_io;
  Table t("panel");
  t.text("driver", by_channel ? "modbus-io" : "gpio");
  if (by_channel) {
    t.modbus_line(panel.io_module);
    t.number("poll_ms", panel.poll.count());
  }
  for (const auto& [key, pin] : panel.inputs) t.pin(key, pin, by_channel);
  for (const auto& [key, pin] : panel.outputs) t.pin(key, pin, by_channel);
  return t.text();
}

std::string rest(const RigConfig& rig) {
  std::string text;
  Table calibration("calibration");
  calibration.text("file", rig.calibration_file.string());
  text += calibration.text();
  for (const auto& [name, recipe] : rig.recipes) {
    Table t("recipe." + name);
    t.number("views", recipe.views, "of each pose");
    t.number("poses", recipe.poses, "1: the part is not turned over");
    t.number("flip_timeout_min", recipe.flip_timeout.count(), "then the job is parked");
    text += t.text();
  }
  Table storage("storage");
  storage.text("root", rig.storage.root.string());
  storage.number("reserve_gib", rig.storage.reserve_gib, "stays free");
  Table reconstruction("reconstruction");
  reconstruction.text("executor", "in_process");
  reconstruction.number("memory_gib", rig.reconstruction.memory_gib);
  reconstruction.number("voxel_mm", rig.reconstruction.voxel_mm);
  Table api("api");
  api.text("socket", rig.api.socket.string());
  if (!rig.api.tokens.empty()) api.text("tokens", rig.api.tokens.string(), "made by scanrig token add");
  if (rig.api.http_port) api.number("http_port", *rig.api.http_port, "of the page, on this machine only");
  text += storage.text() + reconstruction.text() + api.text();
  if (rig.gpio_socket) {
    Table gpio("gpio");
    gpio.text("socket", rig.gpio_socket->string());
    text += gpio.text();
  }
  return text;
}

/// The lines of one table, the comment before it included; the head of the file has no name.
struct TableText {
  std::string name;  ///< "recipe" of [recipe.small]
  std::string text;
};

/// "recipe" of "[recipe.small]" and "[[recipe]]"; empty for another line.
std::string table_name(std::string_view line) {
  if (line.empty() || line.front() != '[') return "";
  const auto begin = line.find_first_not_of("[ \"'");
  if (begin == std::string_view::npos) return "";
  return std::string(line.substr(begin, line.find_first_of(". ]\"'", begin) - begin));
}

std::vector<TableText> tables_of(const std::string& text) {
  std::vector<TableText> tables(1);
  std::string comment;  // lines that belong to the table that follows
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (auto name = table_name(line); !name.empty()) {
      tables.push_back({std::move(name), std::exchange(comment, "") + line + "\n"});
    } else if (line.starts_with('#') && tables.size() > 1) {
      comment += line + "\n";
    } else {
      tables.back().text += std::exchange(comment, "") + line + "\n";
    }
  }
  tables.back().text += comment;
  return tables;
}

bool is_of_devices(const TableText& table) {
  constexpr std::array kNames{"", "safety", "turntable", "projector", "stereo_camera", "panel", "gpio"};
  return std::ranges::find(kNames, table.name) != kNames.end();
}

/// Without empty lines at the end.
void add_table(const TableText& table, std::string& text) {
  while (text.ends_with("\n\n")) text.pop_back();
  if (!text.empty()) text += "\n";
  text += table.text;
}

}  // namespace

std::string with_other_tables(const std::string& found, const std::string& present) {
  std::string text;
  for (const auto& table : tables_of(found)) {
    if (is_of_devices(table)) add_table(table, text);
  }
  for (const auto& table : tables_of(present)) {
    if (!is_of_devices(table)) add_table(table, text);
  }
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

std::string rig_toml(const RigConfig& rig) {
  return "# Written by scanrig setup. Every key: docs/guide/configure.md; the shipped example has more of them.\n"
         "schema = 1\n" +
         safety(rig) + turntable(rig.turntable) + projector(rig.projector) + stereo_camera(rig.stereo_camera) +
         panel(rig.panel) + rest(rig);
}

}  // namespace scanrig::config
