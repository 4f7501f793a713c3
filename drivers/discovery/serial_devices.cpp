#include "drivers/discovery/serial_devices.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <set>

namespace scanrig::discovery {
namespace {

using modbus::Parity;
using std::chrono::milliseconds;

constexpr milliseconds kReplyTimeout{40};  ///< longer than any requested frame takes at 9600 baud
constexpr milliseconds kGrblPatience{300};
constexpr int kAttempts = 5;

std::vector<modbus::ClientOptions> ways_to_ask(const modbus::ClientOptions& configured, int max_unit) {
  std::vector<modbus::ClientOptions> ways;
  const auto add = [&](int baud, Parity parity, int unit) {
    auto way = configured;
    way.baud = baud;
    way.parity = parity;
    way.unit_id = unit;
    way.reply_timeout = std::max(configured.reply_timeout, kReplyTimeout);
    ways.push_back(way);
  };
  const std::array parities{Parity::none, Parity::even, Parity::odd};
  add(configured.baud, configured.parity, configured.unit_id);
  for (const Parity parity : parities) add(configured.baud, parity, configured.unit_id);
  for (int unit = 1; unit <= max_unit; ++unit) add(configured.baud, configured.parity, unit);
  for (const int baud : {9600, 19200, 38400, 57600, 115200}) {
    for (const Parity parity : parities) {
      if (baud != configured.baud) add(baud, parity, configured.unit_id);
    }
  }
  return ways;
}

bool can_read(modbus::Client& line, ModbusTrait trait, Deadline deadline) {
  return trait.table == ModbusTrait::Table::inputs ? line.read_inputs(trait.address, 1, deadline).has_value()
                                                   : line.read(trait.address, 1, deadline).has_value();
}

/// Registers that tell a drive of this profile from another device.
std::vector<ModbusTrait> traits_of(const DriveProfile& profile) {
  std::vector<ModbusTrait> traits;
  const auto add = [&](std::optional<std::uint16_t> address) {
    if (address) traits.push_back({ModbusTrait::Table::registers, *address});
  };
  add(profile.status.address);
  add(profile.feedback_address);
  add(profile.alarm.address);
  add(profile.pulses_per_motor_rev.multiply_address);
  add(profile.pulses_per_motor_rev.divide_address);
  return traits;
}

bool fits(const modbus::ClientOptions& options, const DriveProfile& profile, Clock& clock) {
  modbus::Client line(options, clock);
  return std::ranges::all_of(traits_of(profile), [&](ModbusTrait trait) {
    return can_read(line, trait, Deadline::after(clock, kAttempts * options.reply_timeout)) ||
           // One missed reply is no missing register.
           (line.reply_missed() && can_read(line, trait, Deadline::after(clock, kAttempts * options.reply_timeout)));
  });
}

/// Adapters by the name that stays; `dev`/ttyUSB0 and its like have none.
std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder, std::string_view prefix) {
  std::vector<std::filesystem::path> found;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().filename().native().starts_with(prefix)) found.push_back(entry->path());
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace

std::vector<std::string> serial_ports(const std::filesystem::path& dev) {
  std::vector<std::string> ports;
  std::set<std::filesystem::path> named;
  std::error_code ignored;
  for (const auto& link : entries_of(dev / "serial" / "by-id", "")) {
    if (named.insert(std::filesystem::weakly_canonical(link, ignored)).second) ports.push_back(link.string());
  }
  for (const char* prefix : {"ttyUSB", "ttyACM"}) {
    for (const auto& port : entries_of(dev, prefix)) {
      if (named.insert(std::filesystem::weakly_canonical(port, ignored)).second) ports.push_back(port.string());
    }
  }
  return ports;
}

std::string_view word(Parity parity) {
  switch (parity) {
    case Parity::none: return "none";
    case Parity::even: return "even";
    case Parity::odd: return "odd";
  }
  return "none";
}

std::optional<std::string> grbl_answer(const std::string& device, Clock& clock) {
  const int port = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) return std::nullopt;
  termios settings{};
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  ::cfsetspeed(&settings, B115200);
  ::tcsetattr(port, TCSANOW, &settings);
  ::tcflush(port, TCIOFLUSH);
  std::string said;
  if (::write(port, "?", 1) == 1) {
    for (const auto by = Deadline::after(clock, kGrblPatience); !by.expired(clock);) {
      pollfd watched{port, POLLIN, 0};
      const auto left = std::chrono::ceil<milliseconds>(by.left(clock));
      std::array<char, 256> bytes;
      if (::poll(&watched, 1, static_cast<int>(left.count())) <= 0) break;
      const ssize_t count = ::read(port, bytes.data(), bytes.size());
      if (count <= 0) break;
      said.append(bytes.data(), static_cast<std::size_t>(count));
    }
  }
  ::close(port);
  // A status report "<Idle|MPos:...>", or the banner of a controller that opening the port has reset.
  if (said.find('<') == std::string::npos && said.find("Grbl") == std::string::npos) return std::nullopt;
  while (!said.empty() && said.back() <= ' ') said.pop_back();
  return said;
}

std::optional<ModbusAnswer> find_modbus(const modbus::ClientOptions& configured, ModbusTrait trait, int max_unit,
                                        Clock& clock) {
  for (const auto& way : ways_to_ask(configured, max_unit)) {
    modbus::Client line(way, clock);
    if (can_read(line, trait, Deadline::after(clock, kAttempts * way.reply_timeout))) return ModbusAnswer{way, true};
    if (line.statistics().io_errors > 0) return std::nullopt;
    if (line.statistics().refused > 0) return ModbusAnswer{way, false};
  }
  return std::nullopt;
}

std::optional<SerialDevice> find_serial_device(const std::string& device,
                                               const std::map<std::string, DriveProfile>& profiles, Clock& clock) {
  SerialDevice found;
  found.line.device = device;
  if (auto said = grbl_answer(device, clock)) {
    found.kind = SerialDevice::Kind::grbl;
    found.answer = *std::move(said);
    return found;
  }
  int max_unit = 1;
  for (const auto& [name, profile] : profiles) max_unit = std::max(max_unit, profile.max_unit_id);
  const auto answer = find_modbus(found.line, {ModbusTrait::Table::inputs, 0}, max_unit, clock);
  if (!answer) return std::nullopt;
  found.line = answer->line;
  for (const auto& [name, profile] : profiles) {
    if (fits(found.line, profile, clock)) found.profiles.push_back(name);
  }
  if (!found.profiles.empty()) {
    found.kind = SerialDevice::Kind::drive;
  } else if (answer->has_trait) {
    found.kind = SerialDevice::Kind::io_module;
  }
  return found;
}

}  // namespace scanrig::discovery
