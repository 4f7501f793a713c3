#pragma once

#include <filesystem>
#include <memory>

#include "core/result.h"
#include "daemon/rig/preview.h"
#include "daemon/station/control_loop.h"

namespace scanrig {

/// The HTTP API on a Unix socket: one I/O thread, every request and answer with an absolute time limit.
class ApiServer {
 public:
  /// Fails as listen_on_socket(). `loop` and `preview` must outlive the server.
  static Result<std::unique_ptr<ApiServer>> start(const std::filesystem::path& socket, ControlLoop& loop,
                                                  Preview& preview);
  /// Cuts all connections, removes the socket file and joins. The control loop must not run any more.
  ~ApiServer();
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

 private:
  struct Impl;
  explicit ApiServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace scanrig
