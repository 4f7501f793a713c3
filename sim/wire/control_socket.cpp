#include "sim/wire/control_socket.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <vector>

namespace scanrig::sim::wire {
namespace {

constexpr std::size_t kMaxLineLength = 1 << 20;
constexpr int kBacklog = 16;

std::optional<sockaddr_un> address_of(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof(address.sun_path)) return std::nullopt;
  std::memcpy(address.sun_path, path.c_str(), path.native().size());
  return address;
}

bool send_all(int descriptor, const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = ::send(descriptor, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

/// Appends received bytes; false at the end of the connection.
bool receive(int descriptor, std::string& pending) {
  std::array<char, 4096> bytes;
  const ssize_t count = ::recv(descriptor, bytes.data(), bytes.size(), 0);
  if (count <= 0) return false;
  pending.append(bytes.data(), static_cast<std::size_t>(count));
  return pending.size() <= kMaxLineLength;
}

std::optional<std::string> take_line(std::string& pending) {
  const auto end = pending.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = pending.substr(0, end);
  pending.erase(0, end + 1);
  return line;
}

}  // namespace

Result<std::unique_ptr<ControlSocket>> ControlSocket::start(std::filesystem::path path, Handler handler) {
  const auto address = address_of(path);
  if (!address) return fail(ErrorCode::io, "the path {} is too long for a socket", path.string());
  ::unlink(path.c_str());
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0 ||
      ::listen(listener, kBacklog) != 0) {
    const int reason = errno;
    ::close(listener);
    return fail(ErrorCode::io, "listen on {}: {}", path.string(), std::strerror(reason));
  }
  const int wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  return std::unique_ptr<ControlSocket>(new ControlSocket(std::move(path), std::move(handler), listener, wake));
}

ControlSocket::ControlSocket(std::filesystem::path path, Handler handler, int listener, int wake)
    : path_(std::move(path)),
      handler_(std::move(handler)),
      listener_(listener),
      wake_(wake),
      thread_([this](const std::stop_token& stop) { serve(stop); }) {}

ControlSocket::~ControlSocket() {
  thread_.request_stop();
  ::eventfd_write(wake_, 1);
  thread_.join();
  ::close(listener_);
  ::close(wake_);
  ::unlink(path_.c_str());
}

void ControlSocket::serve(const std::stop_token& stop) {
  std::vector<Client> clients;
  while (!stop.stop_requested()) {
    std::vector<pollfd> watched{{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
    for (const Client& client : clients) watched.push_back({client.descriptor, POLLIN, 0});
    ::poll(watched.data(), watched.size(), -1);
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (!watched[i + 2].revents || read_from(clients[i])) continue;
      ::close(clients[i].descriptor);
      clients[i].descriptor = -1;
    }
    std::erase_if(clients, [](const Client& client) { return client.descriptor < 0; });
    if (watched[1].revents) {
      if (const int accepted = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC); accepted >= 0) {
        clients.push_back({accepted});
      }
    }
  }
  for (const Client& client : clients) ::close(client.descriptor);
}

/// False when the client has gone or sends no valid line.
bool ControlSocket::read_from(Client& client) {
  if (!receive(client.descriptor, client.pending)) return false;
  while (const auto line = take_line(client.pending)) {
    if (!send_all(client.descriptor, handler_(*line) + "\n")) return false;
  }
  return true;
}

Result<std::string> send_to_control_socket(const std::filesystem::path& path, const std::string& line) {
  const auto address = address_of(path);
  if (!address) return fail(ErrorCode::io, "the path {} is too long for a socket", path.string());
  const int peer = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string pending;
  std::optional<std::string> reply;
  bool open = ::connect(peer, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0 &&
              send_all(peer, line + "\n");
  const int reason = errno;
  while (open && !reply) {
    open = receive(peer, pending);
    reply = take_line(pending);
  }
  ::close(peer);
  if (reply) return *reply;
  return fail(ErrorCode::io, "no simulated rig listens at {}: {}", path.string(), std::strerror(reason));
}

}  // namespace scanrig::sim::wire
