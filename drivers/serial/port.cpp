#include "drivers/serial/port.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <utility>

namespace scanrig::serial {
namespace {

tl::unexpected<Error> gone(const std::string& device, std::string_view reason) {
  return fail(ErrorCode::io, "{}: the port is gone ({}); check the cable and the adapter", device, reason);
}

/// Fails with the cause.
Result<void> set_up(int descriptor, int baud, Port::Lock lock) {
  static const std::map<int, speed_t> speeds{{9600, B9600},   {19200, B19200},   {38400, B38400},
                                             {57600, B57600}, {115200, B115200}, {230400, B230400}};
  const auto speed = speeds.find(baud);
  if (speed == speeds.end()) return fail(ErrorCode::io, "no speed of {} baud", baud);
  if (lock == Port::Lock::exclusive && ::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    return fail(ErrorCode::io, "{}", errno == EWOULDBLOCK ? "another program is using it" : std::strerror(errno));
  }
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return fail(ErrorCode::io, "{}", std::strerror(errno));
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  // A controller that restarts when DTR falls must not do so whenever this process ends.
  settings.c_cflag &= ~static_cast<tcflag_t>(HUPCL | CSTOPB | PARENB | CRTSCTS);
  ::cfsetspeed(&settings, speed->second);
  if (::tcsetattr(descriptor, TCSANOW, &settings) != 0) return fail(ErrorCode::io, "{}", std::strerror(errno));
  return {};
}

}  // namespace

Result<Port> Port::open(const std::string& device, int baud, Lock lock) {
  const int descriptor = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return fail(ErrorCode::io, "open {}: {}", device, std::strerror(errno));
  Port port(descriptor, device);
  if (auto ready = set_up(descriptor, baud, lock); !ready) return pass_on(ready, "open " + device);
  port.finding_ = request_low_latency(descriptor, device);
  return port;
}

Port::Port(Port&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      device_(std::move(other.device_)),
      finding_(std::move(other.finding_)) {}

Port& Port::operator=(Port&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(device_, other.device_);
  std::swap(finding_, other.finding_);
  return *this;
}

Port::~Port() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<bool> Port::ready(short events, Clock::Duration wait) {
  pollfd watched{descriptor_, events, 0};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(std::max(wait, Clock::Duration::zero()));
  if (::poll(&watched, 1, static_cast<int>(ms.count())) < 0 && errno != EINTR) return gone(device_, "poll failed");
  if ((watched.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return gone(device_, "hung up");
  return (watched.revents & events) != 0;
}

Result<void> Port::write(std::string_view bytes, Clock::Duration wait) {
  while (!bytes.empty()) {
    const auto free = ready(POLLOUT, wait);
    if (!free) return pass_on(free);
    if (!*free) return fail(ErrorCode::timeout, "{}: the line takes no more bytes", device_);
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno != EAGAIN && errno != EINTR) return gone(device_, std::strerror(errno));
    if (count > 0) bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return {};
}

Result<std::string> Port::read(Clock::Duration wait) {
  const auto heard = ready(POLLIN, wait);
  if (!heard) return pass_on(heard);
  if (!*heard) return std::string();
  std::array<char, 256> bytes;
  const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
  if (count == 0) return gone(device_, "end of file");
  if (count < 0) {
    if (errno == EAGAIN || errno == EINTR) return std::string();
    return gone(device_, std::strerror(errno));
  }
  return std::string(bytes.data(), static_cast<std::size_t>(count));
}

}  // namespace scanrig::serial
