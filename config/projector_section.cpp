#include "config/projector_section.h"

#include "config/pin.h"

namespace scanrig::config {
namespace {

void expect_as_long_as(std::chrono::microseconds exposure, std::string_view key, std::chrono::microseconds light,
                       Section& s) {
  if (light >= exposure) return;
  s.report(key, fmt::format("{} is shorter than the longest exposure of {} in [stereo_camera]", light.count(),
                            exposure.count()));
}

/// Reads polarity and pulse of both lines.
void read_pulse(Section& s, std::chrono::microseconds exposure, ProjectorConfig& projector) {
  if (s.has("active")) s.choice<bool>("active", projector.line.active_low, {{"low", true}, {"high", false}});
  if (projector.plain_line) projector.plain_line->active_low = projector.line.active_low;
  s.number("pulse_us", projector.pulse, {10, 1'000'000});
  expect_as_long_as(exposure, "pulse_us", projector.pulse, s);
}

void read_gpio(Section& s, std::chrono::microseconds exposure, ProjectorConfig& projector) {
  projector.line = read_output_line(s, "line");
  if (s.has("plain_line")) projector.plain_line = read_output_line(s, "plain_line");
  read_pulse(s, exposure, projector);
}

void read_modbus_io(Section& s, std::chrono::microseconds exposure, ProjectorConfig& projector) {
  s.number("channel", projector.line.channel, {0, 255});
  if (s.has("plain_channel")) s.number("plain_channel", projector.plain_line.emplace().channel, {0, 255});
  read_pulse(s, exposure, projector);
}

/// The outputs by the camera's own names. The camera's exposure is the length of the light.
void read_camera_strobe(Section& s, ProjectorConfig& projector) {
  s.text("line", projector.line.line);
  if (s.has("plain_line")) s.text("plain_line", projector.plain_line.emplace().line);
}

/// The ranges are the device's, see LightCrafterProjector::create().
void read_lightcrafter(Section& s, std::chrono::microseconds exposure, ProjectorConfig& projector) {
  using Trigger = dlpc350::LutEntry::Trigger;
  LightCrafterOptions& options = projector.lightcrafter;
  if (s.has("serial")) s.text("serial", projector.serial);
  s.number("image", options.image, {0, 63});
  s.number("pattern", options.pattern, {0, 23});
  s.number("depth_bits", options.depth, {1, 8});
  s.section("led_current", [&](Section& led) {
    led.number("red", options.led_current[0], {0, 255});
    led.number("green", options.led_current[1], {0, 255});
    led.number("blue", options.led_current[2], {0, 255});
  });
  s.number("exposure_us", options.exposure, {235, 10'000'000});
  expect_as_long_as(exposure, "exposure_us", options.exposure, s);
  if (s.has("trigger_out")) {
    s.section("trigger_out", [&](Section& out) {
      if (out.has("active")) out.choice<bool>("active", options.trigger_out_inverted, {{"low", true}, {"high", false}});
      if (out.has("delay_ns")) out.number("delay_ns", options.trigger_out_delay, {-20'000, 2'700});
    });
  }
  if (s.has("trigger_in")) {
    s.section("trigger_in", [&](Section& in) {
      in.choice<Trigger>("edge", options.trigger_in, {{"rising", Trigger::rising}, {"falling", Trigger::falling}});
      if (in.has("delay_ns")) in.number("delay_ns", options.trigger_in_delay, {0, 1'000'000'000});
    });
  }
  s.number("reply_timeout_ms", options.reply_timeout, {10, 5'000});
}

}  // namespace

void read_projector(Section& s, std::chrono::microseconds exposure, ProjectorConfig& projector) {
  using Driver = ProjectorConfig::Driver;
  s.choice<Driver>("driver", projector.driver,
                   {{"gpio", Driver::gpio},
                    {"modbus-io", Driver::modbus_io},
                    {"lightcrafter4500", Driver::lightcrafter4500},
                    {"camera-strobe", Driver::camera_strobe},
                    {"manual", Driver::manual}});
  if (projector.driver == Driver::gpio) read_gpio(s, exposure, projector);
  if (projector.driver == Driver::modbus_io) read_modbus_io(s, exposure, projector);
  if (projector.driver == Driver::lightcrafter4500) read_lightcrafter(s, exposure, projector);
  if (projector.driver == Driver::camera_strobe) read_camera_strobe(s, projector);
  s.number("warm_up_s", projector.warm_up, {0, 7200});
}

namespace {

/// The right camera exposes at the edge that the left camera's output makes.
void check_strobe_cameras(Section& s, const StereoCameraConfig& camera) {
  if (camera.driver != StereoCameraConfig::Driver::aravis) {
    return s.report("driver",
                    "\"camera-strobe\" needs driver = \"aravis\" in [stereo_camera]: only GigE and USB3 Vision cameras "
                    "have outputs that follow their exposure");
  }
  if (camera.aravis.trigger_source == "Software") {
    s.report(
        "driver",
        "\"camera-strobe\" needs trigger.source in [stereo_camera] to be the right camera's input that the outputs "
        "are wired to, not \"Software\"");
  }
}

}  // namespace

void check_projector(Section& s, const RigConfig& rig) {
  using Driver = ProjectorConfig::Driver;
  const Driver driver = rig.projector.driver;
  if (driver == Driver::lightcrafter4500 || driver == Driver::manual) return;
  const bool by_channel = driver == Driver::modbus_io;
  const bool module = rig.panel.driver == PanelConfig::Driver::modbus_io;
  const char* const line = by_channel ? "channel" : "line";
  const char* const plain_line = by_channel ? "plain_channel" : "plain_line";
  if (by_channel && !module) {
    s.report("driver", "\"modbus-io\" uses the panel's I/O module: it needs driver = \"modbus-io\" in [panel]");
  }
  if (driver == Driver::camera_strobe) check_strobe_cameras(s, rig.stereo_camera);
  if (!rig.projector.plain_line) {
    s.report(plain_line, "missing: every view needs a plain image; name the output that fires it");
  }
  if (!s.sound()) return;
  const bool shares_panel = driver != Driver::camera_strobe && by_channel == module;
  std::map<std::string, Pin> outputs{{line, rig.projector.line}, {plain_line, *rig.projector.plain_line}};
  report_shared(s, outputs, shares_panel ? rig.panel.outputs : std::map<std::string, Pin>{});
}

}  // namespace scanrig::config
