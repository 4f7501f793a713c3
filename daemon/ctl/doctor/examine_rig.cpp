#include <fcntl.h>
#include <grp.h>
#include <linux/gpio.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "core/files.h"
#include "core/signal_stop.h"
#include "daemon/ctl/doctor/examine_rig.h"
#include "drivers/projector/lightcrafter_link.h"

namespace scanrig::ctl::doctor {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> entries(const fs::path& folder, std::string_view prefix = "") {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().filename().native().starts_with(prefix)) found.push_back(entry->path());
  }
  std::ranges::sort(found);
  return found;
}

/// The text of a file in /sys without its line end; empty where there is none.
std::string attribute(const fs::path& file) {
  auto text = read_file(file).value_or("");
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string group_name(gid_t group) {
  const ::group* entry = ::getgrgid(group);
  return entry ? entry->gr_name : std::to_string(group);
}

std::string user_name() {
  const ::passwd* entry = ::getpwuid(::geteuid());
  return entry ? entry->pw_name : std::to_string(::geteuid());
}

std::vector<gid_t> own_groups() {
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(::getgroups(0, nullptr), 0)));
  const int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  groups.push_back(::getegid());
  return groups;
}

/// Milliseconds for which an FTDI adapter keeps what it has received.
void check_latency(const std::string& port, Report& report) {
  const auto timer = attribute(fs::path("/sys/bus/usb-serial/devices") / port / "latency_timer");
  if (timer.empty() || timer == "1") return;
  report.find("serial_latency", fmt::format("The adapter at /dev/{} passes bytes on after {} ms.", port, timer),
              "Install the package's rules for devices (60-scanrig.rules), then plug the adapter in again.");
}

void list_serial(Report& report) {
  report.section("Serial adapters");
  std::vector<fs::path> named = entries("/dev/serial/by-id"), seen;
  std::error_code ignored;
  for (const fs::path& link : named) {
    seen.push_back(fs::canonical(link, ignored));
    report.note(fmt::format("{} -> {}", link.string(), seen.back().string()));
  }
  for (const char* prefix : {"ttyUSB", "ttyACM"}) {
    for (const fs::path& port : entries("/dev", prefix)) {
      if (std::ranges::find(seen, port) == seen.end()) report.note(port.string() + " (no name by id)");
      seen.push_back(port);
    }
  }
  for (const fs::path& port : seen) check_latency(port.filename().string(), report);
  if (seen.empty()) report.note("none");
}

/// The chip's lines that have a name, as the kernel lists them.
void list_chip(const fs::path& device, Report& report) {
  const int chip = ::open(device.c_str(), O_RDWR | O_CLOEXEC);
  if (chip < 0) return report.note(fmt::format("{}: {}", device.string(), std::strerror(errno)));
  gpiochip_info info{};
  std::string names;
  if (::ioctl(chip, GPIO_GET_CHIPINFO_IOCTL, &info) == 0) {
    for (std::uint32_t offset = 0; offset < info.lines; ++offset) {
      gpio_v2_line_info line{};
      line.offset = offset;
      if (::ioctl(chip, GPIO_V2_GET_LINEINFO_IOCTL, &line) == 0 && line.name[0]) names += fmt::format(" {}", line.name);
    }
  }
  ::close(chip);
  report.note(fmt::format("{} ({}, {} lines):{}", device.string(), info.label, info.lines, names));
}

void list_gpio(Report& report) {
  report.section("GPIO chips");
  const auto chips = entries("/dev", "gpiochip");
  for (const fs::path& chip : chips) list_chip(chip, report);
  if (chips.empty()) report.note("none: panel and projector need a Modbus I/O module or a USB GPIO adapter here");
}

void list_usb(Report& report) {
  report.section("USB devices");
  bool any = false;
  for (const fs::path& device : entries("/sys/bus/usb/devices")) {
    const auto vendor = attribute(device / "idVendor");
    if (vendor.empty() || vendor == "1d6b") continue;  // 1d6b: the kernel's own hubs
    any = true;
    report.note(fmt::format("{}:{} {} serial {}", vendor, attribute(device / "idProduct"),
                            attribute(device / "product"), attribute(device / "serial")));
  }
  if (!any) report.note("none");
}

void list_groups(Report& report) {
  report.section("User");
  std::string names;
  for (const gid_t group : own_groups()) names += fmt::format(" {}", group_name(group));
  report.note(fmt::format("{}, groups:{}", user_name(), names));
}

}  // namespace

void list_what_is_connected(Report& report) {
  list_serial(report);
  list_gpio(report);
  list_usb(report);
  list_groups(report);
}

bool may_open(const fs::path& device, const std::string& section, Report& report) {
  struct stat facts {};
  if (::stat(device.c_str(), &facts) != 0) {
    report.find("device_missing", fmt::format("[{}] names {}, and there is no such device.", section, device.string()),
                "Plug the adapter in, or name another one of those listed above; a udev rule keeps the name.");
    return false;
  }
  if (::access(device.c_str(), R_OK | W_OK) == 0) return true;
  const auto groups = own_groups();
  const std::string group = group_name(facts.st_gid);
  if (std::ranges::find(groups, facts.st_gid) == groups.end() && (facts.st_mode & S_IWGRP) != 0) {
    report.find("missing_group",
                fmt::format("The user {} may not open {}: it belongs to the group {}, and the user is not in it.",
                            user_name(), device.string(), group),
                fmt::format("sudo usermod -aG {} {}, then log in again.", group, user_name()));
  } else {
    report.find("no_access",
                fmt::format("The user {} may not open {}: {}.", user_name(), device.string(), std::strerror(EACCES)),
                "Give the device a group that may read and write (see the udev rule), and the user that group.");
  }
  return false;
}

namespace {

/// The first of the device's parents in /sys that has a USB serial number.
std::string usb_serial_of(const fs::path& device) {
  std::error_code error;
  const auto name = fs::canonical(device, error).filename();
  auto node = fs::canonical(fs::path("/sys/class/tty") / name / "device", error);
  for (; !error && node != node.root_path(); node = node.parent_path()) {
    if (auto serial = attribute(node / "serial"); !serial.empty()) return serial;
  }
  return {};
}

/// Whether a udev rule gives the name: one of the rig's, or those by serial number that every Debian has.
bool a_rule_names(const fs::path& device) {
  if (device.native().starts_with("/dev/serial/by-id/")) return true;
  const std::string name = device.lexically_relative("/dev").string();
  for (const char* folder : {"/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
    for (const fs::path& rule : entries(folder)) {
      if (read_file(rule).value_or("").find("\"" + name + "\"") != std::string::npos) return true;
    }
  }
  return false;
}

bool unit_is_installed() {
  for (const char* folder : {"/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system"}) {
    std::error_code ignored;
    if (fs::exists(fs::path(folder) / "scanrigd.service", ignored)) return true;
  }
  return false;
}

}  // namespace

void print_missing_snippets(const fs::path& device, const fs::path& config, Report& report) {
  if (device.native().starts_with("/dev/") && !a_rule_names(device)) {
    const auto serial = usb_serial_of(device);
    report.section("Missing: a udev rule, /etc/udev/rules.d/70-scanrig.rules");
    report.note(
        fmt::format("SUBSYSTEM==\"tty\", ATTRS{{serial}}==\"{}\", SYMLINK+=\"{}\", GROUP=\"dialout\", "
                    "MODE=\"0660\"",
                    serial.empty() ? "(the adapter's serial number)" : serial,
                    device.native().starts_with("/dev/scanrig/") ? device.lexically_relative("/dev").string()
                                                                 : "scanrig/turntable"));
  }
  if (unit_is_installed()) return;
  report.section("Missing: the service's unit, /etc/systemd/system/scanrigd.service");
  const auto file = fs::absolute(config).string();
  for (const auto& line :
       {std::string("[Service]"), "ExecStart=/usr/bin/scanrigd --config " + file,
        "ExecStopPost=/usr/bin/scanrigd --make-safe --config " + file, std::string("SupplementaryGroups=dialout gpio"),
        std::string("DevicePolicy=closed"), std::string("DeviceAllow=char-ttyUSB rw"),
        std::string("DeviceAllow=char-ttyACM rw"), std::string("DeviceAllow=char-gpiochip rw"),
        std::string("RuntimeDirectory=scanrig"), std::string("RuntimeDirectoryPreserve=yes"),
        std::string("Restart=on-failure"), std::string("[Install]"), std::string("WantedBy=multi-user.target")}) {
    report.note(line);
  }
}

namespace {

/// Cameras, light and calibration. Fails with `stopped`, the light being off.
Result<void> examine_sight(const Rig& rig, Clock& clock, Report& report) {
  if (rig.config.stereo_camera.driver == config::StereoCameraConfig::Driver::simulated) {
    report.section("Cameras");
    report.note("simulated by scanrigd-sim: not examined");
    return {};
  }
  const SignalStop signal;
  auto images = examine_cameras(rig, signal.token(), clock, report);
  if (!images) return pass_on(images);
  bool may_match = false;
  if (!images->pattern.left.empty()) {
    report.section("Light");
    if (rig.config.projector.driver == config::ProjectorConfig::Driver::manual) {
      report.note("switched by hand: judged in pattern light only");
      images->off = images->plain = {};
    }
    may_match = judge_images(*images, report);
  }
  examine_calibration(rig, *images, may_match, report);
  if (signal.token().stop_requested()) return fail(ErrorCode::stopped, "stopped on request");
  return {};
}

/// A LightCrafter reports its firmware; other projectors report nothing.
void examine_projector(const config::RigConfig& config, Clock& clock, Report& report) {
  if (config.projector.driver != config::ProjectorConfig::Driver::lightcrafter4500) return;
  report.section("Projector");
  dlpc350::Link link(dlpc350::usb_transport(config.projector.serial, clock),
                     config.projector.lightcrafter.reply_timeout, clock);
  const auto version = [&]() -> Result<std::optional<dlpc350::Version>> {
    if (auto opened = link.open(); !opened) return pass_on(opened);
    return dlpc350::read_version(link, Deadline::after(clock, std::chrono::seconds(5)));
  }();
  if (!version) {
    report.find("projector_silent", fmt::format("The projector does not respond: {}.", version.error().message),
                "Check its power and its USB cable.");
  } else if (!*version || **version < dlpc350::kOldestFirmware) {
    report.find("projector_firmware",
                *version ? fmt::format("The projector's firmware {} is too old.", to_string(**version))
                         : "The projector has no whole firmware.",
                "Write it with scanrig projector load.");
  } else {
    report.note(fmt::format("LightCrafter 4500, firmware {}", to_string(**version)));
  }
}

}  // namespace

Result<void> examine_rig(const Rig& rig, bool may_turn, const Operator& person, Clock& clock, Report& report) {
  list_what_is_connected(report);
  examine_projector(rig.config, clock, report);
  const bool drive_answers = examine_drive(rig.config, clock, report);
  const bool estop_works = examine_panel(rig.config, drive_answers, person, clock, report);
  const auto permitted = [&] {
    return may_turn || (person.is_at_rig() && person.prompt("Is everyone clear? Turn the table? [y/N]") == "y");
  };
  if (auto seen = examine_sight(rig, clock, report); !seen) return seen;
  examine_machine(rig, clock, report);
  Result<void> moved;
  if (drive_answers && estop_works && permitted()) moved = examine_motion(rig, person, clock, report);
  print_missing_snippets(rig.config.turntable.device(), rig.file, report);
  return moved;
}

}  // namespace scanrig::ctl::doctor
