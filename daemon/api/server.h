#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/setup/session.h"
#include "core/result.h"
#include "daemon/api/admission.h"
#include "daemon/api/roles.h"
#include "daemon/journal/journal.h"
#include "daemon/station/control_loop.h"
#include "pipeline/calibration/placement/placement_aid.h"

namespace scanrig {

struct ApiOptions {
  std::filesystem::path socket;
  PeerGroups groups{};             ///< rights of each over the socket
  std::optional<int> http_port{};  ///< TCP, where every request needs a token; 0: any free port
  std::string http_address = "127.0.0.1";
  std::filesystem::path tokens{};  ///< the file of tokens
  std::filesystem::path logins{};  ///< where logged-in browsers are remembered; empty: until the process ends
  std::string http_origin{};       ///< "https://rig.example": how browsers reach it through the proxy; empty: directly
  bool insecure_http = false;      ///< other machines may connect without TLS; the page says so
  std::string proxy{};             ///< the reverse proxy in front, as find_proxy() reads it; empty: none
  /// Listening sockets of the caller, used instead of an own one and left open and in place at the end.
  std::optional<int> passed_socket{}, passed_tcp{};
  std::filesystem::path storage{};  ///< whose disk is watched
  /// `is_middle`: its middle in full resolution. From any thread.
  std::function<Result<std::string>(std::string_view side, bool is_middle)> preview_jpeg = no_preview;
  std::function<Result<PlacementView>(const AwaitedPlacement&)> look_at_board = no_board;  ///< likewise
  std::function<Result<void>()> check_config = no_config;  ///< of the file that the daemon was started with; likewise
  /// Reads that file again and restarts with it if the rig is idle; the reply as for orders to the ControlLoop.
  std::function<void(ControlLoop::Reply)> reload = no_reload;  ///< may take long; from any thread
  /// Setup from the page; null: this service has no devices to lend.
  std::shared_ptr<config::setup::Session> setup{};
  /// Lends it the devices for a request of `who`, and takes them back. Fail as orders to the ControlLoop; the reply of
  /// begin is the key.
  std::function<void(const std::string& who, ControlLoop::Reply)> begin_setup{};
  std::function<void(ControlLoop::Reply)> end_setup{};
  ApiLimits limits{};
  const RecentLog* log = nullptr;                                  ///< for the page; null: there is none
  std::function<void(JournalEntry)> journal = [](const auto&) {};  ///< orders refused; from any thread, must not wait

  static Result<std::string> no_preview(std::string_view, bool) {
    return fail(ErrorCode::not_found, "there are no cameras");
  }
  static Result<PlacementView> no_board(const AwaitedPlacement&) { return pass_on(no_preview({}, false)); }
  static Result<void> no_config() {
    return fail(ErrorCode::refused, "the service was started without a configuration file");
  }
  static void no_reload(const ControlLoop::Reply& reply) { reply(pass_on(no_config())); }
};

/// The HTTP API on a Unix socket and, if wanted, on TCP: two I/O threads, a strand per connection, every step of a
/// request with an absolute limit. It reads snapshots and posts to the control loop, and neither waits for the other.
class ApiServer {
 public:
  /// Fails as listen_on_socket(), with `io` or `invalid_input` for the address, with `not_found` for a group or the
  /// proxy's user. `loop` must outlive the server.
  static Result<std::unique_ptr<ApiServer>> start(const ApiOptions& options, ControlLoop& loop);
  /// Cuts all connections, removes the socket file and joins. The control loop must not run any more.
  ~ApiServer();
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

  /// Takes a new snapshot. From any thread; does not wait.
  void wake();
  [[nodiscard]] int http_port() const;  ///< 0 without TCP

 private:
  struct Impl;
  explicit ApiServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace scanrig
