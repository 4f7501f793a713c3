#include "daemon/api/socket_file.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

Result<sockaddr_un> address_of(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.native().size() >= sizeof address.sun_path) {
    return fail(ErrorCode::invalid_input, "{}: not a path for a socket, which has 1 to {} bytes", path.string(),
                sizeof address.sun_path - 1);
  }
  std::memcpy(address.sun_path, path.c_str(), path.native().size());
  return address;
}

tl::unexpected<Error> fail_errno(const char* doing, const fs::path& path, int fd) {
  auto error = fail(ErrorCode::io, "cannot {} the socket {}: {}", doing, path.string(), std::strerror(errno));
  if (fd >= 0) ::close(fd);
  return error;
}

int open_socket() { return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0); }

const sockaddr* as_sockaddr(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

Result<void> check_free(const fs::path& path) {
  std::error_code error;
  const auto status = fs::symlink_status(path, error);
  if (status.type() == fs::file_type::not_found) return {};
  if (status.type() != fs::file_type::socket) {
    return fail(ErrorCode::exists, "{}: is there and no socket: name another path", path.string());
  }
  const auto other = connect_to_socket(path);
  if (other) ::close(*other);
  if (other || other.error().code == ErrorCode::timeout) {
    return fail(ErrorCode::refused, "{}: another daemon listens there", path.string());
  }
  return other.error().code == ErrorCode::not_found ? Result<void>() : pass_on(other);
}

}  // namespace

Result<int> connect_to_socket(const fs::path& path, std::chrono::microseconds limit) {
  const auto address = address_of(path);
  if (!address) return pass_on(address);
  const int fd = open_socket();
  if (fd < 0) return fail_errno("make", path, fd);
  const auto whole = std::chrono::floor<std::chrono::seconds>(limit);
  const timeval reply_timeout{.tv_sec = whole.count(), .tv_usec = (limit - whole).count()};
  ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &reply_timeout, sizeof reply_timeout);
  if (::connect(fd, as_sockaddr(*address), sizeof *address) == 0) return fd;
  const int why = errno;
  if (why != ENOENT && why != ECONNREFUSED && why != EAGAIN) return fail_errno("connect to", path, fd);
  ::close(fd);
  if (why == ENOENT) return fail(ErrorCode::not_found, "{}: no such socket", path.string());
  if (why == ECONNREFUSED) return fail(ErrorCode::not_found, "{}: no service listens", path.string());
  return fail(ErrorCode::timeout, "{}: the service does not accept the connection", path.string());
}

fs::path socket_path(int listening) {
  sockaddr_un address{};
  socklen_t size = sizeof address;
  if (::getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  return {std::string(address.sun_path, ::strnlen(address.sun_path, sizeof address.sun_path))};
}

Result<int> take_over_socket(int passed, mode_t mode) {
  const auto path = socket_path(passed);
  const int own = ::fcntl(passed, F_DUPFD_CLOEXEC, 0);
  struct stat file {};
  if (own < 0 || ::stat(path.c_str(), &file) != 0) return fail_errno("use the passed", path, own);
  // Its creator has most likely set the mode already, and may be another user.
  if ((file.st_mode & 0777) != mode && ::chmod(path.c_str(), mode) != 0)
    return fail_errno("set the mode of", path, own);
  return own;
}

Result<int> listen_on_socket(const fs::path& path, mode_t mode) {
  if (auto address = address_of(path); !address) return pass_on(address);
  if (path.has_parent_path()) {
    if (auto made = create_directories_synced(path.parent_path()); !made) return pass_on(made);
  }
  if (auto free = check_free(path); !free) return pass_on(free);
  // Bound under another name: no client can connect before the mode is set. The rename also removes a stale file.
  fs::path temporary = path;
  temporary += fmt::format(".{}", ::getpid());
  const auto address = address_of(temporary);
  if (!address) return pass_on(address);
  ::unlink(temporary.c_str());
  const int fd = open_socket();
  if (fd < 0) return fail_errno("make", path, fd);
  if (::bind(fd, as_sockaddr(*address), sizeof *address) != 0) return fail_errno("bind", path, fd);
  if (::chmod(temporary.c_str(), mode) != 0 || ::listen(fd, SOMAXCONN) != 0 ||
      ::rename(temporary.c_str(), path.c_str()) != 0) {
    auto error = fail_errno("open", path, fd);
    ::unlink(temporary.c_str());
    return error;
  }
  return fd;
}

}  // namespace scanrig
