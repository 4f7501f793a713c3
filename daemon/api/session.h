#pragma once

#include <atomic>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <memory>
#include <optional>

#include "daemon/api/access.h"
#include "daemon/api/admission.h"
#include "daemon/api/event_hub.h"
#include "daemon/api/origins.h"
#include "daemon/api/route.h"
#include "daemon/api/server.h"

namespace scanrig {

inline std::string_view plain(boost::beast::string_view text) { return {text.data(), text.size()}; }

/// State shared by all connections. Outlives them.
struct ServerCore {
  ServerCore(ApiStation what, PeerRoles peers, Proxy in_front, const ApiOptions& options, std::string life)
      : station(std::move(what)),
        access(peers, options.tokens, options.logins),
        proxy(std::move(in_front)),
        origins(options.http_origin),
        limits(options.limits),
        journal(options.journal),
        admission(std::make_shared<Admission>(options.limits)),
        hub(std::move(life)) {}

  const Router router;
  const ApiStation station;
  Access access;
  const Proxy proxy;
  const OwnOrigins origins;
  const ApiLimits limits;
  const std::function<void(JournalEntry)> journal;
  const std::shared_ptr<Admission> admission;
  EventHub hub;
  std::atomic<std::uint64_t> requests = 0, refused = 0;
  const std::shared_ptr<int> answers = std::make_shared<int>();  ///< one more owner for every reply on its way out
  boost::asio::thread_pool workers{2};                           ///< for work that touches the disk
  boost::asio::thread_pool background{1};                        ///< for work of seconds, at low priority
  std::stop_source ends;                                         ///< of the work in the background
};

/// Origin of a connection.
struct ApiPeer {
  Admission::Door door = Admission::Door::tcp;
  std::string name{};          ///< a user of this machine, or an address
  std::optional<Role> role{};  ///< from the kernel's record of the peer; nothing over TCP and for a proxy
  bool is_proxy = false;       ///< names the sender in each request
};

/// One connection, over TCP or a Unix socket: reads a request, replies, reads the next. Lives as long as a step
/// is under way on it, each with an absolute limit. All of it runs on the socket's strand.
class ApiSession : public std::enable_shared_from_this<ApiSession> {
 public:
  using Protocol = boost::asio::generic::stream_protocol;

  ApiSession(Protocol::socket socket, ServerCore& core, ApiPeer peer)
      : stream_(std::move(socket)), timer_(stream_.get_executor()), core_(core), peer_(std::move(peer)) {}
  ~ApiSession();

  void start();

 private:
  using Error = boost::beast::error_code;

  /// An order, as the log records its refusal. Holds no more of the request than its path.
  struct JobOrder {
    std::string asked;
    std::string job{};
  };

  enum class Place { waiting, seat, reserved };

  void take(Place place, Admission::SeatPtr seat);
  bool take_seat(bool may_use_reserved);
  Admission::OnEvicted when_evicted();
  void evicted(std::uint64_t number);
  void read_header();
  void on_header(Error error);
  bool may_request(const Route* route, bool authenticated);
  void refuse(ApiResponse response, bool must_close);
  void on_body(Error error);
  void call();
  [[nodiscard]] std::optional<ApiResponse> refuse_stranger() const;
  [[nodiscard]] std::optional<JobOrder> order_of() const;
  void tell_refused(const JobOrder& order, const std::string& why) const;
  void await_answer(std::chrono::milliseconds reply_timeout);
  [[nodiscard]] Send sender();
  void answer(ApiResponse response);
  void set_head(const ApiResponse& response);
  [[nodiscard]] std::string head_text() const;
  void write_text(ApiResponse response);
  void on_written(Error error);
  void hang_up();
  void drain();
  void drain_more();
  [[nodiscard]] std::string_view method() const;
  [[nodiscard]] std::string_view header(boost::beast::http::field name) const;
  [[nodiscard]] Identity identify() const;
  [[nodiscard]] std::string requester() const;

  [[nodiscard]] bool is_known(const ApiResponse& response) const;
  void begin_file(ApiResponse response);
  void read_chunk();
  void write_chunk();

  void begin_events(const ApiResponse& response);
  void events_due();
  void send_events(EventHub::Batch batch);
  void wait_for_events();
  void beat();

  boost::beast::basic_stream<Protocol> stream_;
  boost::asio::steady_timer timer_;
  ServerCore& core_;
  const ApiPeer peer_;
  Admission::SeatPtr seat_;
  Place place_ = Place::waiting;
  std::uint64_t seat_number_ = 0;  ///< number of seats this connection has had
  std::string requester_;          ///< sender of this request
  Identity identity_;              ///< likewise
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  std::optional<Router::Match> match_;
  std::optional<JobOrder> order_;    ///< the order in progress; nothing for requests that only read
  bool is_head_ = false;             ///< HEAD: as GET, without the body
  bool once_ = false;                ///< as of the route
  bool waiting_ = false;             ///< for a reply to the request
  bool last_ = false;                ///< no request can follow
  std::shared_ptr<int> on_its_way_;  ///< while a reply is being written
  boost::beast::http::response<boost::beast::http::string_body> response_;
  std::string chunk_;  ///< head or part of a file, or what is left of a drained request

  std::shared_ptr<OpenFile> file_;
  std::uint64_t sent_ = 0, end_ = 0;  ///< of the file: what comes next, and where the wanted part ends

  std::optional<std::uint64_t> subscription_;
  std::uint64_t last_event_ = 0;
  bool beats_ = false;
  std::vector<EventHub::Text> batch_;
  bool writing_events_ = false;
};

}  // namespace scanrig
