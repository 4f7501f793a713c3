#include "sim/wire/pty.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

namespace scanrig::sim::wire {

Result<Pty> Pty::open(const std::filesystem::path& link) {
  const auto failed = [](const char* what) {
    return fail(ErrorCode::io, "cannot {} a pseudo-terminal: {}", what, std::strerror(errno));
  };
  // Never inherited, not even by a program that another thread starts just now: its copy would keep the line open.
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (master < 0) return failed("open");
  Pty pty(master, link);
  std::array<char, 64> name{};
  if (::grantpt(master) != 0 || ::unlockpt(master) != 0) return failed("unlock");
  if (::ptsname_r(master, name.data(), name.size()) != 0) return failed("name");
  pty.slave_ = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (pty.slave_ < 0) return failed("open");
  termios raw{};
  cfmakeraw(&raw);
  if (::tcsetattr(pty.slave_, TCSANOW, &raw) != 0) return failed("set up");
  std::error_code error;
  std::filesystem::remove(link, error);
  std::filesystem::create_symlink(name.data(), link, error);
  if (error) return fail(ErrorCode::io, "cannot create {}: {}", link.string(), error.message());
  return pty;
}

Pty::Pty(Pty&& other) noexcept
    : master_(std::exchange(other.master_, -1)),
      slave_(std::exchange(other.slave_, -1)),
      link_(std::exchange(other.link_, {})) {}

Pty::~Pty() {
  if (master_ < 0) return;
  std::error_code ignored;
  std::filesystem::remove(link_, ignored);
  if (slave_ >= 0) ::close(slave_);
  ::close(master_);
}

Bytes Pty::read(std::chrono::milliseconds wait) {
  pollfd watched{master_, POLLIN, 0};
  if (::poll(&watched, 1, static_cast<int>(wait.count())) <= 0) return {};
  Bytes bytes(256);
  const ssize_t count = ::read(master_, bytes.data(), bytes.size());
  bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return bytes;
}

void Pty::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(master_, bytes.data(), bytes.size());
    if (count <= 0) return;  // no reader: as on a wire
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

}  // namespace scanrig::sim::wire
