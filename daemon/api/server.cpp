#include "daemon/api/server.h"

#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <optional>
#include <set>
#include <thread>

#include "daemon/api/routes.h"
#include "daemon/api/socket_file.h"

namespace scanrig {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Local = net::local::stream_protocol;

constexpr auto kTimeLimit = std::chrono::seconds(10);  ///< for a whole request and for a whole answer
constexpr std::uint64_t kBodyLimit = 64 * 1024;
constexpr std::uint32_t kHeaderLimit = 8 * 1024;
constexpr std::size_t kMostSessions = 64;

/// One connection. Owned by the server's set: an answer that comes when the connection is gone finds nobody.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Local::socket socket, ControlLoop& loop, Preview& preview,
          std::function<void(std::shared_ptr<Session>)> forget)
      : stream_(std::move(socket)), loop_(loop), preview_(preview), forget_(std::move(forget)) {}

  void read() {
    parser_.emplace();
    parser_->body_limit(kBodyLimit);
    parser_->header_limit(kHeaderLimit);
    stream_.expires_after(kTimeLimit);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) { self->on_read(error); });
  }

 private:
  void on_read(beast::error_code error) {
    if (error) return forget_(shared_from_this());
    const auto& request = parser_->get();
    const ApiRequest plain{std::string(request.method_string()), std::string(request.target())};
    const auto send = [weak = weak_from_this()](ApiResponse response) {
      if (const auto self = weak.lock()) {
        net::post(self->stream_.get_executor(), [weak, response = std::move(response)] {
          if (const auto session = weak.lock()) session->write(response);
        });
      }
    };
    answer(plain, loop_, preview_, send);
  }

  void write(const ApiResponse& response) {
    const auto& request = parser_->get();
    response_ = {static_cast<http::status>(response.status), request.version()};
    response_.set(http::field::content_type, response.content_type);
    response_.keep_alive(request.keep_alive());
    response_.body() = response.body;
    response_.prepare_payload();
    stream_.expires_after(kTimeLimit);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error || !self->response_.keep_alive()) return self->forget_(self);
      self->read();
    });
  }

  beast::basic_stream<Local> stream_;
  ControlLoop& loop_;
  Preview& preview_;
  std::function<void(std::shared_ptr<Session>)> forget_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

struct ApiServer::Impl {
  Impl(std::filesystem::path socket, int listening, ControlLoop& control, Preview& pictures)
      : path(std::move(socket)), acceptor(io, Local(), listening), loop(control), preview(pictures) {}

  void accept() {
    acceptor.async_accept([this](beast::error_code error, Local::socket socket) {
      if (!acceptor.is_open()) return;
      if (!error && sessions.size() < kMostSessions) {
        const auto session = std::make_shared<Session>(
            std::move(socket), loop, preview, [this](const std::shared_ptr<Session>& gone) { sessions.erase(gone); });
        sessions.insert(session);
        session->read();
      }
      accept();
    });
  }

  net::io_context io{1};
  std::filesystem::path path;
  Local::acceptor acceptor;
  ControlLoop& loop;
  Preview& preview;
  std::set<std::shared_ptr<Session>> sessions;  // of the I/O thread
  std::thread thread;
};

Result<std::unique_ptr<ApiServer>> ApiServer::start(const std::filesystem::path& socket, ControlLoop& loop,
                                                    Preview& preview) {
  const auto listening = listen_on_socket(socket);
  if (!listening) return pass_on(listening, "API");
  auto impl = std::make_unique<Impl>(socket, *listening, loop, preview);
  impl->accept();
  impl->thread = std::thread([io = &impl->io] { io->run(); });
  return std::unique_ptr<ApiServer>(new ApiServer(std::move(impl)));
}

ApiServer::ApiServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

ApiServer::~ApiServer() {
  impl_->io.stop();
  impl_->thread.join();
  ::unlink(impl_->path.c_str());
}

}  // namespace scanrig
