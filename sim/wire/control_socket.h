#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/result.h"

namespace scanrig::sim::wire {

/// Where tests and people play the world: a Unix socket on which any number of clients say a line and hear a line.
/// What the lines mean is the answerer's business.
/// Threads: the answerer is called from the socket's own thread, one line at a time; it must not wait long.
class ControlSocket {
 public:
  using Answer = std::function<std::string(const std::string& line)>;

  /// Fails with `io`.
  static Result<std::unique_ptr<ControlSocket>> start(std::filesystem::path path, Answer answer);
  ~ControlSocket();

 private:
  struct Client {
    int descriptor = -1;
    std::string pending{};
  };

  ControlSocket(std::filesystem::path path, Answer answer, int listener, int wake);
  void serve(const std::stop_token& stop);
  bool listen_to(Client& client);

  const std::filesystem::path path_;
  const Answer answer_;
  const int listener_;
  const int wake_;  // an eventfd: the end
  std::jthread thread_;
};

/// One line said to the socket at `path` and the line it answers. Fails with `io`.
Result<std::string> say_to_control_socket(const std::filesystem::path& path, const std::string& line);

}  // namespace scanrig::sim::wire
