#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <filesystem>

namespace scanrig {

/// A listening Unix socket, bound where it stays, like those that systemd passes. -1: it could not be made.
inline int make_passed_socket(const std::filesystem::path& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.string().copy(address.sun_path, sizeof address.sun_path - 1);
  const bool bound = ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  return bound && ::listen(fd, SOMAXCONN) == 0 ? fd : -1;
}

}  // namespace scanrig
