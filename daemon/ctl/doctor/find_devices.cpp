#include "daemon/ctl/doctor/find_devices.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <vector>

namespace scanrig::ctl::doctor {
namespace {

using modbus::Parity;
using std::chrono::milliseconds;

constexpr milliseconds kReplyTimeout{40};  ///< longer than any requested frame takes at 9600 baud
constexpr milliseconds kGrblPatience{300};

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

}  // namespace

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

std::optional<ModbusAnswer> find_modbus(const modbus::ClientOptions& configured, std::uint16_t address, int max_unit,
                                        Clock& clock) {
  for (const auto& way : ways_to_ask(configured, max_unit)) {
    modbus::Client line(way, clock);
    const auto read = line.read(address, 1, Deadline::after(clock, 5 * way.reply_timeout));
    if (read) return ModbusAnswer{way, true};
    if (line.statistics().refused > 0) return ModbusAnswer{way, false};
  }
  return std::nullopt;
}

}  // namespace scanrig::ctl::doctor
