#include "daemon/webhook/http_post.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <optional>

namespace scanrig {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Tcp = net::ip::tcp;

/// One exchange, step after step; every step runs in the io_context of the caller.
class Exchange {
 public:
  Exchange(net::io_context& io, const HttpAddress& address, const std::string& json) : resolver_(io), stream_(io) {
    request_ = {http::verb::post, address.path, 11};
    request_.set(http::field::host, address.host);
    request_.set(http::field::content_type, "application/json");
    request_.keep_alive(false);
    request_.body() = json;
    request_.prepare_payload();
    resolver_.async_resolve(address.host, address.port, [this](auto error, const auto& found) {
      if (!end(error)) connect(found);
    });
  }

  /// Nothing while it is not over.
  std::optional<boost::system::error_code> ended{};
  http::response<http::string_body> response;

 private:
  bool end(boost::system::error_code error) {
    if (error) ended = error;
    return ended.has_value();
  }
  void connect(const Tcp::resolver::results_type& found) {
    stream_.async_connect(found, [this](auto error, const auto&) {
      if (!end(error)) write();
    });
  }
  void write() {
    http::async_write(stream_, request_, [this](auto error, auto) {
      if (!end(error)) read();
    });
  }
  void read() {
    http::async_read(stream_, buffer_, response, [this](auto error, auto) { ended = error; });
  }

  Tcp::resolver resolver_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{64 * 1024};
  http::request<http::string_body> request_;
};

}  // namespace

Result<void> http_post(const HttpAddress& address, const std::string& json, std::chrono::milliseconds limit) {
  try {
    net::io_context io;
    Exchange exchange(io, address, json);
    io.run_for(limit);
    if (!exchange.ended) {
      return fail(ErrorCode::timeout, "{}:{} did not answer within {} ms", address.host, address.port, limit.count());
    }
    if (*exchange.ended) {
      return fail(ErrorCode::io, "{}:{}: {}", address.host, address.port, exchange.ended->message());
    }
    const auto status = exchange.response.result_int();
    if (status / 100 == 2) return {};
    return fail(ErrorCode::protocol, "{}:{} answered with {}", address.host, address.port, status);
  } catch (const std::exception& e) {
    return fail(ErrorCode::io, "{}:{}: {}", address.host, address.port, e.what());
  }
}

}  // namespace scanrig
