#include "daemon/ctl/client.h"

#include <fcntl.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/api/socket_file.h"

namespace scanrig::ctl {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;
using Answer = tl::expected<nlohmann::json, RequestError>;

constexpr auto kTooOftenPause = std::chrono::milliseconds(50);
constexpr auto kTooOftenLimit = std::chrono::seconds(10);

Answer unreachable(std::string message) {
  return tl::unexpected(RequestError{ExitCode::unreachable, std::move(message)});
}

Answer understand(const http::response<http::string_body>& response, const std::string& target) {
  auto json = nlohmann::json::parse(response.body(), nullptr, false);
  if (response.result() == http::status::ok && json.is_object()) return json;
  if (!json.is_object() || !json.contains("error") || !json["error"].is_object()) {
    return unreachable(fmt::format("{}: not a reply of the API (HTTP {})", target, response.result_int()));
  }
  const auto code = parse_error_code(json["error"].value("code", ""));
  return tl::unexpected(
      RequestError{exit_code(code.value_or(ErrorCode::internal)), json["error"].value("message", "")});
}

/// A file that is removed in the end, whatever happens.
struct Removed {
  std::filesystem::path path;
  ~Removed() { ::unlink(path.c_str()); }
};

/// A connection to the daemon on which every wait ends: a stopped or hanging daemon sends nothing at all.
class Link {
 public:
  static tl::expected<std::unique_ptr<Link>, RequestError> open(const std::filesystem::path& path,
                                                                Clock::Duration limit) {
    const auto by = Clock::TimePoint::clock::now() + limit;
    const auto connected = connect_to_socket(path, std::chrono::ceil<std::chrono::microseconds>(limit));
    if (connected) return std::unique_ptr<Link>(new Link(path, *connected, by, limit));
    const auto& why = connected.error();
    if (why.code == ErrorCode::timeout) return tl::unexpected(too_late(path, limit));
    return tl::unexpected(RequestError{
        ExitCode::unreachable, why.message + (why.code == ErrorCode::not_found ? "; is the service running?" : "")});
  }

  /// Sets `limit` for what follows.
  void give(Clock::Duration limit) {
    limit_ = limit;
    by_ = Clock::TimePoint::clock::now() + limit;
  }
  error_code write(http::request<http::string_body>& request) {
    return wait([&](auto done) { http::async_write(socket_, request, std::move(done)); });
  }
  error_code read(http::response<http::string_body>& response) {
    return wait([&](auto done) { http::async_read(socket_, buffer_, response, std::move(done)); });
  }
  error_code read_header(http::response_parser<http::buffer_body>& parser) {
    return wait([&](auto done) { http::async_read_header(socket_, buffer_, parser, std::move(done)); });
  }
  error_code read(http::response_parser<http::buffer_body>& parser) {
    return wait([&](auto done) { http::async_read(socket_, buffer_, parser, std::move(done)); });
  }
  [[nodiscard]] tl::unexpected<RequestError> failed(const error_code& error) const {
    if (error == net::error::timed_out) return tl::unexpected(too_late(path_, limit_));
    return tl::unexpected(RequestError{
        ExitCode::unreachable, fmt::format("{}: the service does not respond: {}", path_.string(), error.message())});
  }

 private:
  Link(std::filesystem::path path, int fd, Clock::TimePoint by, Clock::Duration limit)
      : path_(std::move(path)), by_(by), limit_(limit), socket_(io_, net::local::stream_protocol(), fd) {}

  static RequestError too_late(const std::filesystem::path& path, Clock::Duration limit) {
    return {ExitCode::unreachable,
            fmt::format("{}: the service has not responded within {:g} s; check `systemctl status scanrigd`, and "
                        "restart it where it hangs",
                        path.string(), std::chrono::duration<double>(limit).count())};
  }

  /// Runs until the operation that `begin` starts is done. A time-out ends the connection.
  template <class Begin>
  error_code wait(const Begin& begin) {
    error_code result;
    begin([&result](const error_code& error, std::size_t) { result = error; });
    io_.restart();
    io_.run_until(by_);
    if (io_.stopped()) return result;
    socket_.close(result);
    io_.run();
    return net::error::timed_out;
  }

  const std::filesystem::path path_;
  Clock::TimePoint by_;
  Clock::Duration limit_;
  net::io_context io_;
  net::local::stream_protocol::socket socket_;
  boost::beast::flat_buffer buffer_;
};

http::request<http::string_body> request_for(const std::string& method, const std::string& target,
                                             const std::string& body) {
  http::request<http::string_body> request(http::string_to_verb(method), target, 11, body);
  request.set(http::field::host, "localhost");
  request.keep_alive(false);
  if (!body.empty()) request.set(http::field::content_type, "application/json");
  request.prepare_payload();
  return request;
}

using Response = http::response<http::string_body>;

tl::expected<Response, RequestError> exchange_once(const std::filesystem::path& path,
                                                   http::request<http::string_body>& request, Clock::Duration limit) {
  const auto link = Link::open(path, limit);
  if (!link) return tl::unexpected(link.error());
  Response response;
  auto error = (*link)->write(request);
  if (!error) error = (*link)->read(response);
  if (error) return (*link)->failed(error);
  return response;
}

/// A client that sends too many requests gets an error, and repeats its request a little later.
tl::expected<Response, RequestError> exchange(const std::filesystem::path& path, const std::string& method,
                                              const std::string& target, const std::string& body,
                                              Clock::Duration limit) {
  RealClock clock;
  auto request = request_for(method, target, body);
  const auto by = Deadline::after(clock, kTooOftenLimit);
  for (;; clock.sleep_for(kTooOftenPause)) {
    auto response = exchange_once(path, request, limit);
    if (!response || response->result() != http::status::too_many_requests || by.expired(clock)) return response;
  }
}

tl::unexpected<RequestError> request_error_of(Link& link, http::response_parser<http::buffer_body>&& begun,
                                              const std::string& target) {
  const auto status = begun.get().result();
  std::string text(16 * 1024, '\0');
  begun.get().body() = {text.data(), text.size(), true};
  if (const auto error = link.read(begun); error && error != http::error::need_buffer) return link.failed(error);
  text.resize(text.size() - begun.get().body().size);
  http::response<http::string_body> response(status, 11, std::move(text));
  const auto answer = understand(response, target);
  if (!answer) return tl::unexpected(RequestError(answer.error()));
  return tl::unexpected(RequestError{ExitCode::internal, target + ": no file came"});
}

tl::unexpected<RequestError> unwritten(const std::filesystem::path& path) {
  return tl::unexpected(
      RequestError{ExitCode::disk, fmt::format("cannot write {}: {}", path.string(), std::strerror(errno))});
}

}  // namespace

Answer send_request(const std::filesystem::path& socket, const std::string& method, const std::string& target,
                    const std::string& body, Clock::Duration limit) {
  const auto response = exchange(socket, method, target, body, limit);
  if (!response) return tl::unexpected(response.error());
  return understand(*response, target);
}

tl::expected<std::string, RequestError> fetch(const std::filesystem::path& socket, const std::string& target) {
  const auto response = exchange(socket, "GET", target, "", kReplyTimeout);
  if (!response) return tl::unexpected(response.error());
  if (response->result() == http::status::ok) return response->body();
  return tl::unexpected(understand(*response, target).error());
}

tl::expected<void, RequestError> download(const std::filesystem::path& path, const std::string& target,
                                          const std::filesystem::path& out, const Arrived& arrived,
                                          Clock::Duration limit) {
  const auto opened = Link::open(path, limit);
  if (!opened) return tl::unexpected(opened.error());
  Link& link = **opened;
  auto request = request_for("GET", target, "");
  http::response_parser<http::buffer_body> parser;
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());
  auto error = link.write(request);
  if (!error) error = link.read_header(parser);
  if (error) return link.failed(error);
  if (parser.get().result() != http::status::ok) return request_error_of(link, std::move(parser), target);
  // The name is taken at the end, and never from an existing file.
  const std::filesystem::path part = out.string() + fmt::format(".part-{}", ::getpid());
  const Removed remove_part{part};
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(part.c_str(), "wbx"), std::fclose);
  if (!file) return unwritten(part);
  std::vector<char> room(1 << 16);
  const auto whole = parser.content_length().value_or(0);
  for (std::uint64_t come = 0; !parser.is_done();) {
    parser.get().body() = {room.data(), room.size(), true};
    link.give(kReplyTimeout);
    error = link.read(parser);
    if (error && error != http::error::need_buffer) return link.failed(error);
    const auto got = room.size() - parser.get().body().size;
    if (std::fwrite(room.data(), 1, got, file.get()) != got) return unwritten(part);
    come += got;
    arrived(come, whole);
  }
  if (std::fflush(file.get()) != 0 || ::fsync(::fileno(file.get())) != 0) return unwritten(part);
  if (::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, out.c_str(), RENAME_NOREPLACE) == 0) return {};
  if (errno != EEXIST) return unwritten(out);
  return tl::unexpected(
      RequestError{ExitCode::bad_input, out.string() + ": already there; name another file with --out"});
}

std::string segment(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-';
    escaped += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return escaped;
}

}  // namespace scanrig::ctl
