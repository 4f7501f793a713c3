#include "config/camera_section.h"

#include <algorithm>
#include <charconv>

#include "pipeline/storage/manifest.h"

namespace scanrig::config {
namespace {

constexpr Range kExposureUs{10, 1'000'000};
constexpr Range kPixels{16, 65535};
constexpr Range kFrameTimeoutMs{10, 10'000};

std::vector<Choice<std::string>> choices(std::initializer_list<const char*> names) {
  std::vector<Choice<std::string>> all;
  for (const char* name : names) all.push_back({name, name});
  return all;
}

/// Pixel formats that AravisSensor reads, by SFNC name.
std::vector<Choice<std::string>> aravis_formats() {
  return choices({"Mono8",     "Mono10",   "Mono12",    "Mono14",    "Mono16",    "BayerRG8", "BayerRG10", "BayerRG12",
                  "BayerRG16", "BayerGR8", "BayerGR10", "BayerGR12", "BayerGR16", "BayerGB8", "BayerGB10", "BayerGB12",
                  "BayerGB16", "BayerBG8", "BayerBG10", "BayerBG12", "BayerBG16", "RGB8",     "BGR8",      "YUV422_8"});
}

/// Pixel formats that V4l2Sensor reads, by their four characters.
std::vector<Choice<std::string>> v4l2_formats() {
  return choices({"GREY", "Y10", "Y12", "Y16", "YUYV", "RGB3", "BGR3", "RGGB", "GRBG", "GBRG", "BA81", "RG10", "BA10",
                  "GB10", "BG10", "MJPG"});
}

/// Colour is required: the object is separated from its blue screen by colour. No other outline detection exists yet.
void expect_colour(Section& s, const std::string& format, std::string_view such_as) {
  const bool grey = format.starts_with("Mono") || format == "GREY" || format.starts_with("Y1");
  if (!grey) return;
  s.report("pixel_format",
           fmt::format("{} is grey, and the blue screen needs a colour format, such as {}", format, such_as));
}

/// A frame arrives only after its exposure has ended.
void expect_longer(Section& s, std::chrono::milliseconds timeout, const StereoCameraConfig& camera) {
  const auto exposure = camera.longest_exposure();
  if (timeout > exposure) return;
  s.report("frame_timeout_ms",
           fmt::format("{} is not longer than the {} of {}", timeout.count(),
                       exposure == camera.exposure ? "exposure_us" : "pattern_exposures_us", exposure.count()));
}

/// Up to 64 times as long or as short as `exposure_us`, as scans can record them.
void read_pattern_exposures(Section& s, StereoCameraConfig& camera) {
  if (!s.has("pattern_exposures_us")) return;
  s.items("pattern_exposures_us", [&](std::optional<std::int64_t> us, std::string_view) {
    const double factor = static_cast<double>(us.value_or(0)) / static_cast<double>(camera.exposure.count());
    const bool fits = us && static_cast<double>(*us) >= kExposureUs.min &&
                      static_cast<double>(*us) <= kExposureUs.max && factor >= kMinPatternFactor &&
                      factor <= kMaxPatternFactor;
    auto& others = camera.pattern_exposures;
    if (fits && factor != 1.0 &&
        std::find(others.begin(), others.end(), std::chrono::microseconds(*us)) == others.end())
      return others.push_back(std::chrono::microseconds(*us));
    s.report(
        "pattern_exposures_us",
        fmt::format("must be different whole numbers from {} to {}, other than exposure_us and at most {:g} times as "
                    "long or as short",
                    kExposureUs.min, kExposureUs.max, kMaxPatternFactor));
  });
  if (camera.pattern_exposures.size() > kMaxPatternExposures)
    s.report("pattern_exposures_us", fmt::format("has more than {} exposures", kMaxPatternExposures));
}

void read_region(Section& s, Region& region) {
  s.number("x", region.x, {0, 65535});
  s.number("y", region.y, {0, 65535});
  s.number("width", region.width, kPixels);
  s.number("height", region.height, kPixels);
}

void read_aravis_sensor(Section& section, std::string_view key, AravisSensorOptions& sensor) {
  section.section(key, [&](Section& s) {
    s.text("serial", sensor.serial);
    if (s.has("address")) s.text("address", sensor.address);
  });
}

void read_aravis(Section& s, AravisOptions& options) {
  using FrameClock = TriggeringOptions::FrameClock;
  read_aravis_sensor(s, "left", options.left);
  read_aravis_sensor(s, "right", options.right);
  if (!options.left.serial.empty() && options.left.serial == options.right.serial) {
    s.report("right", "has the same serial number as left");
  }
  s.section("trigger", [&](Section& trigger) {
    trigger.text("source", options.trigger_source);
    trigger.choice<bool>("edge", options.falling_edge, {{"rising", false}, {"falling", true}});
  });
  if (s.choice("pixel_format", options.pixel_format, aravis_formats())) {
    expect_colour(s, options.pixel_format, "BayerRG8");
  }
  s.number("exposure_us", options.exposure, kExposureUs);
  if (s.has("gain")) s.number("gain", options.gain.emplace(), {-100, 10'000});
  if (s.has("black_level")) s.number("black_level", options.black_level.emplace(), {-100, 10'000});
  if (s.has("region")) s.section("region", [&](Section& r) { read_region(r, options.region.emplace()); });
  if (s.has("packet")) {
    s.section("packet", [&](Section& packet) {
      packet.number("size_bytes", options.packet_bytes, {576, 16000});
      packet.number("delay_us", options.packet_delay, {0, 100'000});
    });
  }
  s.choice<FrameClock>("clock", options.frame_clock, {{"interval", FrameClock::interval}, {"ptp", FrameClock::ptp}});
  s.number("frame_timeout_ms", options.frame_timeout, kFrameTimeoutMs);
  s.accept_old_name("idle_refresh_s", "dead_air_s");
  if (s.has("idle_refresh_s")) s.number("idle_refresh_s", options.idle_refresh, {1, 3600});
}

/// { serial = "40012345" } or { device = "/dev/scanrig/left" }.
void read_v4l2_sensor(Section& section, std::string_view key, V4l2SensorOptions& sensor) {
  section.section(key, [&](Section& s) {
    if (s.has("serial")) {
      s.text("serial", sensor.serial);
    } else {
      s.text("device", sensor.device);
    }
  });
}

/// { 0x009A0901 = 1 }: vendor controls, by the number that `v4l2-ctl -L` shows.
void read_controls(Section& s, std::map<std::uint32_t, int>& controls) {
  for (const std::string& key : s.free_keys()) {
    std::uint32_t id = 0;
    const char* end = key.data() + key.size();
    const bool hex = key.starts_with("0x") || key.starts_with("0X");
    const auto [last, failed] = std::from_chars(key.data() + (hex ? 2 : 0), end, id, 16);
    int value = 0;
    s.number(key, value, {-2147483648.0, 2147483647.0});
    if (hex && failed == std::errc() && last == end) {
      controls[id] = value;
    } else {
      s.report(key, "is not the number of a control, such as 0x009A0901");
    }
  }
}

void read_v4l2(Section& s, bool side_by_side, V4l2Options& options) {
  if (side_by_side) {
    read_v4l2_sensor(s, "both", options.left);
  } else {
    auto& right = options.right.emplace();
    read_v4l2_sensor(s, "left", options.left);
    read_v4l2_sensor(s, "right", right);
    if (!options.left.serial.empty() && options.left.serial == right.serial) {
      s.report("right", "has the same serial number as left");
    }
    if (!options.left.device.empty() && options.left.device == right.device) {
      s.report("right", "is the same device as left");
    }
  }
  s.flag("external_trigger", options.external_trigger);
  if (s.choice("pixel_format", options.pixel_format, v4l2_formats())) expect_colour(s, options.pixel_format, "RGGB");
  s.section("size", [&](Section& size) {
    size.number("width", options.size.width, kPixels);
    size.number("height", options.size.height, kPixels);
  });
  if (side_by_side && options.size.width % 2 != 0) s.report("size", "has no two halves: the width must be even");
  s.number("exposure_us", options.exposure, {100, kExposureUs.max});
  if (s.has("gain")) s.number("gain", options.gain.emplace(), {0, 65535});
  if (s.has("controls")) s.section("controls", [&](Section& c) { read_controls(c, options.controls); });
  s.number("frame_timeout_ms", options.frame_timeout, kFrameTimeoutMs);
}

}  // namespace

void read_stereo_camera(Section& s, const std::filesystem::path& base, Cameras cameras, StereoCameraConfig& camera) {
  using Driver = StereoCameraConfig::Driver;
  std::vector<Choice<Driver>> drivers{
      {"aravis", Driver::aravis}, {"v4l2", Driver::v4l2}, {"v4l2-side-by-side", Driver::v4l2_side_by_side}};
  if (cameras == Cameras::or_simulated) drivers.push_back({"simulated", Driver::simulated});
  s.choice<Driver>("driver", camera.driver, drivers);
  switch (camera.driver) {
    case Driver::simulated:
      s.path("truth", base, camera.truth);
      s.number("exposure_us", camera.exposure, kExposureUs);
      read_pattern_exposures(s, camera);
      break;
    case Driver::aravis:
      read_aravis(s, camera.aravis);
      camera.exposure = camera.aravis.exposure;
      read_pattern_exposures(s, camera);
      expect_longer(s, camera.aravis.frame_timeout, camera);
      break;
    case Driver::v4l2:
    case Driver::v4l2_side_by_side:
      read_v4l2(s, camera.driver == Driver::v4l2_side_by_side, camera.v4l2);
      camera.exposure = camera.v4l2.exposure;
      read_pattern_exposures(s, camera);
      expect_longer(s, camera.v4l2.frame_timeout, camera);
      break;
  }
}

}  // namespace scanrig::config
