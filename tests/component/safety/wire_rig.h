#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include "core/files.h"
#include "sim/wire/gpio_socket.h"
#include "sim/wire/leadshine_drive.h"
#include "sim/wire/modbus_server.h"
#include "tests/slowness.h"

namespace scanrig {

/// The far ends of a whole rig, turntable on a pseudo-terminal and the rest on GPIO lines behind a socket, and the
/// rig.toml that points at them. The test is the operator. Real time.
class WireRig {
 public:
  static constexpr auto kReplyTimeout = kSlowness * std::chrono::seconds(20);

  /// Texts of rig.toml and their replacements.
  using Changes = std::vector<std::pair<std::string, std::string>>;

  explicit WireRig(const sim::wire::AxisOptions& axis, const Changes& changes = {}) : drive(axis, clock) {
    std::filesystem::create_directories(folder);
    std::filesystem::copy(std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/drives", folder / "drives");
    plug_in();
    auto text = rig_toml(axis.gear_ratio);
    for (const auto& [from, to] : changes) replace(text, from, to);
    std::ofstream(config()) << text;
  }
  ~WireRig() {
    serial.reset();
    lines.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }

  void press(const std::string& button) {
    lines->set(button, true);
    clock.sleep_for(std::chrono::milliseconds(200));  // the duration of a hand's press, more than the minimum
    lines->set(button, false);
    clock.sleep_for(std::chrono::milliseconds(80));  // and the debouncing of the release
  }
  void set_estop(bool ok) { lines->set("ESTOP_OK", ok); }
  [[nodiscard]] bool lamp(const std::string& name) const { return lines->level(name); }

  /// Checks repeatedly, without disturbing any thread.
  bool wait_for(const std::function<bool()>& as_wanted, Clock::Duration limit = kReplyTimeout) {
    for (const auto end = Deadline::after(clock, limit); !end.expired(clock);
         clock.sleep_for(std::chrono::milliseconds(1))) {
      if (as_wanted()) return true;
    }
    return false;
  }
  bool wait_halted() {
    return wait_for([&] { return lamp("AMBER") && !lamp("BUSY") && !lamp("START_LAMP"); });
  }
  bool wait_ready() {
    return wait_for([&] { return lamp("GREEN") && !lamp("BUSY"); });
  }
  bool wait_fault() {
    return wait_for([&] { return lamp("RED") && !lamp("BUSY"); });
  }
  bool wait_moving() {
    return wait_for([&] { return std::abs(drive.truth().speed_deg_s) > 1; });
  }

  /// Frames from the master since `since` that command the drive to stop, and those that make it move.
  [[nodiscard]] std::vector<Clock::TimePoint> stops(Clock::TimePoint since) const { return frames(since, is_stop); }
  [[nodiscard]] std::vector<Clock::TimePoint> moves(Clock::TimePoint since) const { return frames(since, is_move); }

  [[nodiscard]] std::filesystem::path config() const { return folder / "rig.toml"; }
  [[nodiscard]] std::filesystem::path device() const { return folder / "turntable"; }
  [[nodiscard]] std::filesystem::path api() const { return folder / "api.sock"; }

  RealClock clock;
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) /
                                       ("rig" + std::to_string(::getpid()) + "-" + std::to_string(next_number()));
  sim::wire::LeadshineDrive drive;
  std::unique_ptr<sim::wire::ModbusServer> serial;
  std::unique_ptr<sim::wire::GpioSocket> lines;

 private:
  static int next_number() {
    static std::atomic<int> last = 0;
    return ++last;
  }
  static bool is_stop(const sim::wire::Bytes& b) {  // 06 6002 0040: quick stop
    return b.size() == 8 && b[1] == 0x06 && b[2] == 0x60 && b[3] == 0x02 && b[5] == 0x40;
  }
  static bool is_move(const sim::wire::Bytes& b) {  // the move block, or 06 6002 0020: home
    return b.size() > 8 ? b[1] == 0x10 && b[2] == 0x62 : b[1] == 0x06 && b[2] == 0x60 && b[3] == 0x02 && b[5] == 0x20;
  }
  [[nodiscard]] std::vector<Clock::TimePoint> frames(Clock::TimePoint since,
                                                     bool (*wanted)(const sim::wire::Bytes&)) const {
    std::vector<Clock::TimePoint> found;
    for (const auto& frame : serial->log()) {
      if (frame.from_master && frame.at >= since && wanted(frame.bytes)) found.push_back(frame.at);
    }
    return found;
  }

  static void replace(std::string& text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  /// Replaces the text from the heading `begin` to the heading `end`.
  static std::string replace_section(const std::string& text, const std::string& begin, const std::string& end,
                                     const std::string& section) {
    return text.substr(0, text.find("\n" + begin) + 1) + section + text.substr(text.find("\n" + end) + 1);
  }
  void plug_in() {
    auto server = sim::wire::ModbusServer::start(device(), 1, drive, clock);
    EXPECT_TRUE(server) << server.error().message;
    serial = std::move(*server);
    plug_in_lines();
  }

 public:
  /// The folder of the only job.
  [[nodiscard]] std::filesystem::path only_job() const {
    for (const auto& entry : std::filesystem::directory_iterator(folder / "jobs")) {
      if (entry.is_directory() && !entry.path().filename().string().starts_with('.')) return entry.path();
    }
    ADD_FAILURE() << "no job";
    return {};
  }
  void plug_in_lines() {
    auto socket = sim::wire::GpioSocket::start(folder / "gpio.sock",
                                               {{"START", false},
                                                {"STOP", false},
                                                {"RESET", false},
                                                {"ESTOP_OK", true},
                                                {"GUARD_OK", true},
                                                {"DOTS", false},
                                                {"PLAIN", false},
                                                {"RED", false},
                                                {"AMBER", false},
                                                {"GREEN", false},
                                                {"BUSY", false},
                                                {"START_LAMP", false},
                                                {"FLIP", false},
                                                {"PASS", false},
                                                {"FAIL", false}},
                                               clock);
    EXPECT_TRUE(socket) << socket.error().message;
    lines = std::move(*socket);
  }

 private:
  [[nodiscard]] std::string rig_toml(double gear_ratio) const {
    auto text = *read_file(std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/rigs/example.toml");
    const auto replace = [&](const std::string& from, const std::string& to) { WireRig::replace(text, from, to); };
    replace("estop = { line = \"ESTOP_OK\", active = \"low\" }", "estop = { line = \"ESTOP_OK\" }");
    replace("guard = { line = \"GUARD_OK\", active = \"low\" }", "guard = { line = \"GUARD_OK\" }");
    replace("/dev/scanrig/turntable", device());
    replace("gear_ratio = 90.0", "gear_ratio = " + fmt::format("{:.1f}", gear_ratio));
    replace("\"PROJ_TRIG\"", "\"DOTS\"");
    replace("\"PROJ_PLAIN\"", "\"PLAIN\"");
    for (const char* button : {"START", "STOP", "RESET"}) {
      replace(fmt::format("{{ line = \"{}\", active = \"low\" }}", button), fmt::format("{{ line = \"{}\" }}", button));
    }
    for (const char* lamp : {"RED", "AMBER", "GREEN"})
      replace(fmt::format("\"LAMP_{}\"", lamp), fmt::format("\"{}\"", lamp));
    text += "\n[gpio]\nsocket = \"gpio.sock\"\n";
    text = replace_section(text, "[stereo_camera]", "[panel]",
                           "[stereo_camera]\ndriver = \"v4l2-side-by-side\"\nboth = { device = \"no-camera\" }\n"
                           "external_trigger = true\npixel_format = \"RGGB\"\n"
                           "size = { width = 640, height = 240 }\nexposure_us = 12000\nframe_timeout_ms = 500\n\n");
    replace("/var/lib/scanrig/calibration.json", "calibration.json");
    replace("/var/lib/scanrig/jobs", "jobs");
    replace("/run/scanrig/api.sock", "api.sock");
    return text;
  }
};

}  // namespace scanrig
