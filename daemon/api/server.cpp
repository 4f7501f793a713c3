#include "daemon/api/server.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>
#include <system_error>
#include <thread>
#include <vector>

#include "core/parallel.h"
#include "core/priority.h"
#include "daemon/api/downloads.h"
#include "daemon/api/metrics.h"
#include "daemon/api/session.h"
#include "daemon/api/socket_file.h"

namespace scanrig {
namespace {

namespace net = boost::asio;
using Local = net::local::stream_protocol;
using Tcp = net::ip::tcp;
using Steady = std::chrono::steady_clock;
using ErrorCondition = boost::system::error_code;

constexpr int kThreads = 2;
constexpr auto kEventPeriod = std::chrono::milliseconds(50);  ///< changes closer together become one event
constexpr auto kLookPeriod = std::chrono::seconds(1);         ///< of disk, sensors and the file of tokens
constexpr auto kLastAnswers = std::chrono::milliseconds(200), kLookAgain = std::chrono::milliseconds(1);
constexpr auto kAcceptPause = std::chrono::milliseconds(100);  ///< when there are no descriptors left

std::string this_life() {
  return fmt::format("{:x}", std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1));
}

Result<Tcp::acceptor> listen_on_tcp(net::io_context& io, const std::string& address, int port) {
  ErrorCondition error;
  const auto ip = net::ip::make_address(address, error);
  if (error) return fail(ErrorCode::invalid_input, "{}: not an IP address", address);
  const Tcp::endpoint here(ip, static_cast<unsigned short>(port));
  Tcp::acceptor acceptor(io);
  acceptor.open(here.protocol(), error);
  if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(here, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  if (error) return fail(ErrorCode::io, "cannot listen on {} port {}: {}", address, port, error.message());
  return acceptor;
}

Result<Tcp::acceptor> take_over_tcp(net::io_context& io, int passed) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  const int own = ::fcntl(passed, F_DUPFD_CLOEXEC, 0);
  if (own < 0 || ::getsockname(own, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const auto why = std::system_category().message(errno);
    if (own >= 0) ::close(own);
    return fail(ErrorCode::io, "cannot use the TCP socket that was passed: {}", why);
  }
  return Tcp::acceptor(io, address.ss_family == AF_INET6 ? Tcp::v6() : Tcp::v4(), own);
}

void remove_own_socket(const ApiOptions& options) {
  if (!options.passed_socket) ::unlink(options.socket.c_str());
}

}  // namespace

struct ApiServer::Impl {
  Impl(const ApiOptions& with, const PeerRoles& roles, const Proxy& proxy, int listening, ControlLoop& control)
      : options(with),
        loop(control),
        core(
            {control, [this] { return latest_facts(); }, with.storage, with.preview_jpeg, with.look_at_board,
             with.check_config, with.reload, with.setup, with.begin_setup, with.end_setup,
             [this](std::function<void()> work) { net::post(core.workers, std::move(work)); },
             [this](auto work) { run_in_background(std::move(work)); }, &core.hub, &core.access,
             [this] { return page_address(); }, with.http_origin.starts_with("https://"), with.insecure_http, with.log},
            roles, proxy, with, this_life()),
        local(io, Local(), listening) {}

  void run_in_background(std::function<void(const std::stop_token&)> work) {
    net::post(core.background, [this, work = std::move(work)] {
      lower_priority();
      with_threads(0, [&] { work(core.ends.get_token()); });
    });
  }

  /// As a browser on this machine reaches it.
  [[nodiscard]] std::string page_address() const {
    if (!options.http_origin.empty()) return options.http_origin;
    if (!tcp) return {};
    const auto here = tcp->local_endpoint();
    if (here.address().is_unspecified()) return fmt::format("http://localhost:{}", here.port());
    const auto name = here.address().to_string();
    return here.address().is_v6() ? fmt::format("http://[{}]:{}", name, here.port())
                                  : fmt::format("http://{}:{}", name, here.port());
  }

  void run() {
    core.hub.see(loop.snapshot());
    accept_local();
    if (tcp) accept_tcp();
    look();
    for (int i = 0; i < kThreads; ++i) threads.emplace_back([this] { io.run(); });
  }

  void accept_local() {
    local.async_accept(net::make_strand(io), [this](ErrorCondition error, auto socket) {
      if (!local.is_open()) return;
      if (error) return pause(local_pause, [this] { accept_local(); });
      const auto peer = peer_credentials(socket.native_handle());
      if (peer) begin(std::move(socket), local_peer(*peer));
      accept_local();
    });
  }

  void accept_tcp() {
    tcp->async_accept(net::make_strand(io), [this](ErrorCondition error, auto socket) {
      if (!tcp->is_open()) return;
      if (error) return pause(tcp_pause, [this] { accept_tcp(); });
      ErrorCondition gone;
      const auto peer = socket.remote_endpoint(gone);
      if (!gone) socket.set_option(Tcp::no_delay(true), gone);
      if (!gone) begin(std::move(socket), tcp_peer(peer.address().to_string()));
      accept_tcp();
    });
  }

  template <class Again>
  void pause(net::steady_timer& timer, Again again) {
    timer.expires_after(kAcceptPause);
    timer.async_wait([again](ErrorCondition) { again(); });
  }

  /// Requests through a proxy need a token, whatever its user may do.
  [[nodiscard]] ApiPeer local_peer(const PeerCredentials& peer) const {
    const bool is_proxy = core.proxy.user == peer.uid;
    return {.door = Admission::Door::local,
            .name = fmt::format("user {}", peer.uid),
            .role = is_proxy ? std::nullopt : core.access.peers().role_of(peer),
            .is_proxy = is_proxy};
  }

  [[nodiscard]] ApiPeer tcp_peer(const std::string& address) const {
    auto name = plain_address(address).value_or(address);
    const bool is_proxy = core.proxy.address == name;
    return {.door = Admission::Door::tcp, .name = std::move(name), .is_proxy = is_proxy};
  }

  void begin(ApiSession::Protocol::socket socket, ApiPeer peer) {
    std::make_shared<ApiSession>(std::move(socket), core, std::move(peer))->start();
  }

  /// Runs on a worker, repeatedly.
  void look() {
    look_timer.expires_after(kLookPeriod);
    look_timer.async_wait([this](ErrorCondition) {
      net::post(core.workers, [this] {
        look_now();
        net::post(io, [this] { look(); });
      });
    });
  }

  void look_now() {
    core.access.refresh();
    auto machine = read_machine(options.storage);
    const std::lock_guard guard(facts_mutex);
    facts = std::move(machine);
  }

  ServiceStatus latest_facts() {
    ServiceStatus now;
    {
      const std::lock_guard guard(facts_mutex);
      now = facts;
    }
    now.uptime_s = std::chrono::duration<double>(Steady::now() - begun).count();
    now.tokens_problem = core.access.problem();
    now.connections = core.admission->connections();
    now.event_streams = core.hub.subscribers();
    now.requests = core.requests;
    now.refused = core.refused;
    return now;
  }

  void wake() {
    if (feed_due.exchange(true)) return;
    net::post(feed_timer.get_executor(), [this] {
      feed_timer.expires_at(fed + kEventPeriod);
      feed_timer.async_wait([this](ErrorCondition) {
        fed = Steady::now();
        feed_due = false;
        core.hub.see(loop.snapshot());
      });
    });
  }

  const ApiOptions options;
  ControlLoop& loop;
  ServerCore core;  // outlives the sessions, the last of which end with the I/O context
  net::io_context io{kThreads};
  Local::acceptor local;
  std::optional<Tcp::acceptor> tcp;
  net::steady_timer local_pause{io}, tcp_pause{io}, look_timer{io}, feed_timer{net::make_strand(io)};
  std::atomic<bool> feed_due = false;
  Steady::time_point fed{};
  const Steady::time_point begun = Steady::now();
  std::mutex facts_mutex;
  ServiceStatus facts;
  std::vector<std::thread> threads;
};

Result<std::unique_ptr<ApiServer>> ApiServer::start(const ApiOptions& options, ControlLoop& loop) {
  const auto roles = find_groups(options.groups);
  if (!roles) return pass_on(roles, "API");
  const auto proxy = find_proxy(options.proxy);
  if (!proxy) return pass_on(proxy, "API");
  // Where groups are named the peer's credentials decide, not the file's one group.
  const mode_t mode = options.groups.any() ? 0666 : 0660;
  const auto listening =
      options.passed_socket ? take_over_socket(*options.passed_socket, mode) : listen_on_socket(options.socket, mode);
  if (!listening) return pass_on(listening, "API");
  auto impl = std::make_unique<Impl>(options, *roles, *proxy, *listening, loop);
  if (options.http_port || options.passed_tcp) {
    auto tcp = options.passed_tcp ? take_over_tcp(impl->io, *options.passed_tcp)
                                  : listen_on_tcp(impl->io, options.http_address, *options.http_port);
    if (!tcp) {
      remove_own_socket(options);
      return pass_on(tcp, "API");
    }
    impl->tcp = std::move(*tcp);
  }
  remove_old_bundles(options.storage);
  impl->look_now();
  impl->run();
  return std::unique_ptr<ApiServer>(new ApiServer(std::move(impl)));
}

ApiServer::ApiServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

/// The control loop's last reply still reaches its requester, such as for the reload that ends this server.
ApiServer::~ApiServer() {
  const auto last = Steady::now() + kLastAnswers;
  while (impl_->core.answers.use_count() > 1 && Steady::now() < last) std::this_thread::sleep_for(kLookAgain);
  impl_->io.stop();
  for (auto& thread : impl_->threads) thread.join();
  impl_->core.workers.join();
  impl_->core.ends.request_stop();
  impl_->core.background.join();
  remove_own_socket(impl_->options);
}

void ApiServer::wake() { impl_->wake(); }

int ApiServer::http_port() const { return impl_->tcp ? impl_->tcp->local_endpoint().port() : 0; }

}  // namespace scanrig
