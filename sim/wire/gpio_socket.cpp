#include "sim/wire/gpio_socket.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <sstream>

namespace scanrig::sim::wire {

struct GpioSocket::Client {
  int descriptor = -1;
  std::string pending;
  std::vector<std::string> watched;
  std::string sent_levels;  // the levels last sent to it

  void send(const std::string& word) const {
    const std::string line = word + "\n";
    std::ignore = ::send(descriptor, line.data(), line.size(), MSG_NOSIGNAL);
  }
};

Result<std::unique_ptr<GpioSocket>> GpioSocket::start(std::filesystem::path path, std::map<std::string, bool> lines,
                                                      Clock& clock) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof(address.sun_path)) {
    return fail(ErrorCode::io, "the path {} is too long for a socket", path.string());
  }
  std::memcpy(address.sun_path, path.c_str(), path.native().size());
  ::unlink(path.c_str());
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener, 16) != 0) {
    const int reason = errno;
    ::close(listener);
    return fail(ErrorCode::io, "listen on {}: {}", path.string(), std::strerror(reason));
  }
  const int wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  return std::unique_ptr<GpioSocket>(new GpioSocket(std::move(path), std::move(lines), clock, listener, wake));
}

GpioSocket::GpioSocket(std::filesystem::path path, std::map<std::string, bool> lines, Clock& clock, int listener,
                       int wake)
    : path_(std::move(path)),
      clock_(clock),
      listener_(listener),
      wake_(wake),
      lines_(std::move(lines)),
      thread_([this](const std::stop_token& stop) { serve(stop); }) {}

GpioSocket::~GpioSocket() {
  thread_.request_stop();
  ::eventfd_write(wake_, 1);
  thread_.join();
  ::close(listener_);
  ::close(wake_);
  ::unlink(path_.c_str());
}

void GpioSocket::set(const std::string& line, bool high) {
  {
    const std::scoped_lock lock(mutex_);
    lines_.at(line) = high;
  }
  ::eventfd_write(wake_, 1);
}

bool GpioSocket::level(const std::string& line) const {
  const std::scoped_lock lock(mutex_);
  return lines_.at(line);
}

std::vector<GpioSocket::Edge> GpioSocket::edges() const {
  const std::scoped_lock lock(mutex_);
  return edges_;
}

void GpioSocket::on_edge(std::function<void(const Edge&)> listener) {
  const std::scoped_lock lock(calling_);
  on_edge_ = std::move(listener);
}

void GpioSocket::serve(const std::stop_token& stop) {
  std::vector<Client> clients;
  while (!stop.stop_requested()) {
    std::vector<pollfd> watched{{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
    for (const Client& client : clients) watched.push_back({client.descriptor, POLLIN, 0});
    ::poll(watched.data(), watched.size(), -1);
    eventfd_t ignored;
    if (watched[0].revents) ::eventfd_read(wake_, &ignored);
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (!watched[i + 2].revents) continue;
      Client& client = clients[i];
      std::array<char, 256> bytes;
      const ssize_t count = ::recv(client.descriptor, bytes.data(), bytes.size(), 0);
      if (count <= 0) {
        ::close(client.descriptor);
        client.descriptor = -1;
        continue;
      }
      client.pending.append(bytes.data(), static_cast<std::size_t>(count));
      for (auto end = client.pending.find('\n'); end != std::string::npos; end = client.pending.find('\n')) {
        const std::string words = client.pending.substr(0, end);
        client.pending.erase(0, end + 1);
        client.send(obey(client, words));
      }
    }
    std::erase_if(clients, [](const Client& client) { return client.descriptor < 0; });
    if (watched[1].revents) {
      if (const int accepted = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC); accepted >= 0) {
        clients.push_back({accepted, {}, {}, {}});
      }
    }
    send_changes(clients);
  }
  for (const Client& client : clients) ::close(client.descriptor);
}

std::string GpioSocket::obey(Client& client, const std::string& words) {
  std::istringstream in(words);
  std::string verb, name;
  in >> verb;
  if (verb == "output") {
    int level = 0;
    in >> name >> level;
    return drive(name, level != 0);
  }
  if (verb != "inputs") return "what?";
  const std::scoped_lock lock(mutex_);
  client.sent_levels.clear();
  while (in >> name) {
    const auto line = lines_.find(name);
    if (line == lines_.end()) return "unknown " + name;
    client.watched.push_back(name);
    client.sent_levels += line->second ? '1' : '0';
  }
  return client.sent_levels;
}

std::string GpioSocket::drive(const std::string& name, bool high) {
  std::optional<Edge> edge;
  const std::scoped_lock calling(calling_);
  {
    const std::scoped_lock lock(mutex_);
    const auto line = lines_.find(name);
    if (line == lines_.end()) return "unknown " + name;
    if (line->second != high) edges_.push_back(edge.emplace(Edge{clock_.now(), name, high}));
    line->second = high;
  }
  if (edge && on_edge_) on_edge_(*edge);
  return "ok";
}

void GpioSocket::send_changes(std::vector<Client>& clients) {
  const std::scoped_lock lock(mutex_);
  for (Client& client : clients) {
    std::string levels;
    for (const auto& name : client.watched) levels += lines_.at(name) ? '1' : '0';
    if (levels == client.sent_levels) continue;
    client.sent_levels = levels;
    client.send(levels);
  }
}

}  // namespace scanrig::sim::wire
