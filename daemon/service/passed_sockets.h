#pragma once

#include <optional>

namespace scanrig {

/// Listening sockets that systemd has opened before the daemon (sd_listen_fds(3)), by the name `api` of the socket
/// unit. They live as long as the process: a client that connects during a restart waits and gets its reply.
struct PassedSockets {
  std::optional<int> local{};  ///< Unix socket
  std::optional<int> tcp{};

  [[nodiscard]] bool any() const { return local || tcp; }
};

/// Call once, before any other thread: it takes the variables out of the environment. Closes sockets that are of no
/// use here.
PassedSockets take_passed_sockets();

}  // namespace scanrig
