#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "sim/wire/grbl_controller.h"
#include "sim/wire/wire_server.h"

namespace scanrig::sim::wire {

/// A GRBL controller on a pseudo-terminal. A request is a realtime byte or a line; a fault's `function` is its first
/// byte, and a refusal's exception becomes error:N.
/// Threads: every function may be called from any thread.
class GrblServer final : public WireServer {
 public:
  /// `link`: the port name that a driver opens. Fails with `io`.
  static Result<std::unique_ptr<GrblServer>> start(std::filesystem::path link, GrblController& controller,
                                                   Clock& clock);
  ~GrblServer() override { vanish(); }

  /// Called with every received request, before it is carried out; from the server's thread.
  void on_request(std::function<void(const std::string&)> listener);

 private:
  GrblServer(std::filesystem::path link, GrblController& controller, Clock& clock)
      : WireServer(std::move(link), clock), controller_(controller) {}

  void serve(const std::stop_token& stop, Pty& pty) override;
  void handle(const std::stop_token& stop, Pty& pty, const std::string& request, bool realtime);

  GrblController& controller_;
  std::mutex listener_mutex_;
  std::function<void(const std::string&)> listener_;
};

}  // namespace scanrig::sim::wire
