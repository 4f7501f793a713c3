#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/result.h"

namespace scanrig::sim::wire {

/// Access to the simulated rig for tests and people: a Unix socket. Any number of clients send a line and receive a
/// line. The handler defines the meaning of the lines.
/// Threads: the handler is called from the socket's own thread, one line at a time; it must not wait long.
class ControlSocket {
 public:
  using Handler = std::function<std::string(const std::string& line)>;

  /// Fails with `io`.
  static Result<std::unique_ptr<ControlSocket>> start(std::filesystem::path path, Handler handler);
  ~ControlSocket();

 private:
  struct Client {
    int descriptor = -1;
    std::string pending{};
  };

  ControlSocket(std::filesystem::path path, Handler handler, int listener, int wake);
  void serve(const std::stop_token& stop);
  bool read_from(Client& client);

  const std::filesystem::path path_;
  const Handler handler_;
  const int listener_;
  const int wake_;  // an eventfd: stop request
  std::jthread thread_;
};

/// Sends one line to the socket at `path` and returns the reply. Fails with `io`.
Result<std::string> send_to_control_socket(const std::filesystem::path& path, const std::string& line);

}  // namespace scanrig::sim::wire
