#include "sim/wire/line_settings.h"

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <map>

namespace scanrig::sim::wire {

std::optional<LineSettings> line_settings(const std::filesystem::path& port) {
  const int descriptor = ::open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return std::nullopt;
  termios found{};
  const bool known = ::tcgetattr(descriptor, &found) == 0;
  ::close(descriptor);
  static const std::map<speed_t, int> bauds{{B9600, 9600},   {B19200, 19200},   {B38400, 38400},
                                            {B57600, 57600}, {B115200, 115200}, {B230400, 230400}};
  const auto baud = bauds.find(::cfgetospeed(&found));
  if (!known || baud == bauds.end()) return std::nullopt;
  if ((found.c_iflag & INPCK) == 0) return LineSettings{baud->second, Parity::none};
  return LineSettings{baud->second, (found.c_cflag & PARODD) != 0 ? Parity::odd : Parity::even};
}

}  // namespace scanrig::sim::wire
