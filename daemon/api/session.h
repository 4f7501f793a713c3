#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <memory>
#include <optional>

#include "daemon/api/server_core.h"

namespace scanrig {

/// One connection, over TCP or a Unix socket: reads a request, answers, reads the next. Lives as long as something
/// is under way on it, each with an absolute limit. All of it runs on the socket's strand.
class ApiSession : public std::enable_shared_from_this<ApiSession> {
 public:
  using Protocol = boost::asio::generic::stream_protocol;

  /// `peer`: the role that the kernel's word for the peer gives it; nothing over TCP.
  ApiSession(Protocol::socket socket, ServerCore& core, std::unique_ptr<Admission::Seat> seat, std::optional<Role> peer)
      : stream_(std::move(socket)), timer_(stream_.get_executor()), core_(core), seat_(std::move(seat)), peer_(peer) {}
  ~ApiSession();

  void start();
  /// Tells a client for whom there is no place, and hangs up.
  void turn_away();

 private:
  using Error = boost::beast::error_code;

  /// An order, as the log tells it when it is refused. Holds no more of the request than its path.
  struct JobOrder {
    std::string asked;
    std::string job{};
  };

  void read_header();
  void on_header(Error error);
  void on_body(Error error);
  void call();
  [[nodiscard]] std::optional<JobOrder> order_of(Role as) const;
  void tell_refused(const JobOrder& order, const std::string& why) const;
  void await_answer(std::chrono::milliseconds reply_timeout);
  [[nodiscard]] Send sender();
  void answer(ApiResponse response);
  void set_head(unsigned status, std::string_view type);
  [[nodiscard]] std::string head_text() const;
  void write_text(ApiResponse response);
  void on_written(Error error);
  void hang_up();
  void drain();
  void drain_more();
  [[nodiscard]] std::string_view header(boost::beast::http::field name) const;
  [[nodiscard]] std::optional<Role> role() const;

  void begin_file(std::shared_ptr<OpenFile> file, std::string_view type);
  void read_chunk();
  void write_chunk();

  void begin_events();
  void events_due();
  void send_events(EventHub::Batch batch);
  void wait_for_events();
  void beat();

  boost::beast::basic_stream<Protocol> stream_;
  boost::asio::steady_timer timer_;
  ServerCore& core_;
  std::unique_ptr<Admission::Seat> seat_;
  std::optional<Role> peer_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  std::optional<Router::Match> match_;
  std::optional<JobOrder> order_;    ///< that is being answered; of what only looks: nothing
  bool waiting_ = false;             ///< for an answer to the request
  bool last_ = false;                ///< no request can follow
  std::shared_ptr<int> on_its_way_;  ///< while an answer is being written
  boost::beast::http::response<boost::beast::http::string_body> response_;
  std::string chunk_;  ///< head or part of a file, or what is left of a drained request

  std::shared_ptr<OpenFile> file_;
  std::uint64_t sent_ = 0;

  std::optional<std::uint64_t> subscription_;
  std::uint64_t last_event_ = 0;
  std::vector<EventHub::Text> batch_;
  bool writing_events_ = false;
};

}  // namespace scanrig
