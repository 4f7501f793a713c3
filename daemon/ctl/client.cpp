#include "daemon/ctl/client.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/time.h>
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

#include "core/clock.h"
#include "daemon/api/socket_file.h"

namespace scanrig::ctl {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;
using Answer = tl::expected<nlohmann::json, Refusal>;

constexpr timeval kPatience{.tv_sec = 15, .tv_usec = 0};
constexpr auto kTooOftenPause = std::chrono::milliseconds(50);
constexpr auto kTooOftenLimit = std::chrono::seconds(10);
constexpr timeval kPackingPatience{.tv_sec = 200, .tv_usec = 0};  ///< a file may have to be made first

Answer unreachable(std::string message) { return tl::unexpected(Refusal{ExitCode::unreachable, std::move(message)}); }

Answer understand(const http::response<http::string_body>& response, const std::string& target) {
  auto json = nlohmann::json::parse(response.body(), nullptr, false);
  if (response.result() == http::status::ok && json.is_object()) return json;
  if (!json.is_object() || !json.contains("error") || !json["error"].is_object()) {
    return unreachable(fmt::format("{}: an answer that is not the API's (HTTP {})", target, response.result_int()));
  }
  const auto code = parse_error_code(json["error"].value("code", ""));
  return tl::unexpected(Refusal{exit_code(code.value_or(ErrorCode::internal)), json["error"].value("message", "")});
}

/// A file that is gone in the end, whatever happens.
struct Removed {
  std::filesystem::path path;
  ~Removed() { ::unlink(path.c_str()); }
};

/// A connection whose every step has a limit.
class Link {
 public:
  Link(int fd, const timeval& patience) : socket_(io_, net::local::stream_protocol(), fd) {
    ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  }
  net::local::stream_protocol::socket& socket() { return socket_; }

 private:
  net::io_context io_;
  net::local::stream_protocol::socket socket_;
};

boost::system::error_code send(Link& link, const std::string& method, const std::string& target,
                               const std::string& body) {
  http::request<http::string_body> request(http::string_to_verb(method), target, 11, body);
  request.set(http::field::host, "localhost");
  request.keep_alive(false);
  if (!body.empty()) request.set(http::field::content_type, "application/json");
  request.prepare_payload();
  boost::system::error_code error;
  http::write(link.socket(), request, error);
  return error;
}

tl::unexpected<Refusal> silent(const std::filesystem::path& path, const boost::system::error_code& error) {
  return tl::unexpected(Refusal{ExitCode::unreachable,
                                fmt::format("{}: the daemon does not answer: {}", path.string(), error.message())});
}

using Response = http::response<http::string_body>;

tl::expected<Response, Refusal> exchange_once(const std::filesystem::path& path, const std::string& method,
                                              const std::string& target, const std::string& body) {
  const auto connected = connect_to_socket(path);
  if (!connected) return tl::unexpected(unreachable(connected.error().message + "; is the daemon running?").error());
  Link link(*connected, kPatience);
  Response response;
  boost::beast::flat_buffer buffer;
  auto error = send(link, method, target, body);
  if (!error) http::read(link.socket(), buffer, response, error);
  if (error) return silent(path, error);
  return response;
}

/// Who asks too often is told so, and asks again a little later.
tl::expected<Response, Refusal> exchange(const std::filesystem::path& path, const std::string& method,
                                         const std::string& target, const std::string& body) {
  RealClock clock;
  const auto by = Deadline::after(clock, kTooOftenLimit);
  for (;; clock.sleep_for(kTooOftenPause)) {
    auto response = exchange_once(path, method, target, body);
    if (!response || response->result() != http::status::too_many_requests || by.expired(clock)) return response;
  }
}

tl::unexpected<Refusal> refusal_of(Link& link, boost::beast::flat_buffer& buffer,
                                   http::response_parser<http::buffer_body>&& begun, const std::string& target) {
  const auto status = begun.get().result();
  std::string text(16 * 1024, '\0');
  begun.get().body() = {text.data(), text.size(), true};
  boost::system::error_code error;
  http::read(link.socket(), buffer, begun, error);
  text.resize(text.size() - begun.get().body().size);
  http::response<http::string_body> response(status, 11, std::move(text));
  const auto answer = understand(response, target);
  if (!answer) return tl::unexpected(Refusal(answer.error()));
  return tl::unexpected(Refusal{ExitCode::internal, target + ": no file came"});
}

tl::unexpected<Refusal> unwritten(const std::filesystem::path& path) {
  return tl::unexpected(
      Refusal{ExitCode::disk, fmt::format("cannot write {}: {}", path.string(), std::strerror(errno))});
}

}  // namespace

Answer ask(const std::filesystem::path& socket, const std::string& method, const std::string& target,
           const std::string& body) {
  const auto response = exchange(socket, method, target, body);
  if (!response) return tl::unexpected(response.error());
  return understand(*response, target);
}

tl::expected<std::string, Refusal> fetch(const std::filesystem::path& socket, const std::string& target) {
  const auto response = exchange(socket, "GET", target, "");
  if (!response) return tl::unexpected(response.error());
  if (response->result() == http::status::ok) return response->body();
  return tl::unexpected(understand(*response, target).error());
}

tl::expected<void, Refusal> download(const std::filesystem::path& path, const std::string& target,
                                     const std::filesystem::path& out, const Arrived& arrived) {
  const auto connected = connect_to_socket(path);
  if (!connected) return tl::unexpected(unreachable(connected.error().message + "; is the daemon running?").error());
  Link link(*connected, kPackingPatience);
  boost::beast::flat_buffer buffer;
  http::response_parser<http::buffer_body> parser;
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());
  auto error = send(link, "GET", target, "");
  if (!error) http::read_header(link.socket(), buffer, parser, error);
  if (error) return silent(path, error);
  if (parser.get().result() != http::status::ok) return refusal_of(link, buffer, std::move(parser), target);
  // The name is taken at the end, and never from somebody who has it.
  const std::filesystem::path part = out.string() + fmt::format(".part-{}", ::getpid());
  const Removed remove_part{part};
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(part.c_str(), "wbx"), std::fclose);
  if (!file) return unwritten(part);
  std::vector<char> room(1 << 16);
  const auto whole = parser.content_length().value_or(0);
  for (std::uint64_t come = 0; !parser.is_done();) {
    parser.get().body() = {room.data(), room.size(), true};
    http::read(link.socket(), buffer, parser, error);
    if (error == http::error::need_buffer) error = {};
    if (error) return silent(path, error);
    const auto got = room.size() - parser.get().body().size;
    if (std::fwrite(room.data(), 1, got, file.get()) != got) return unwritten(part);
    come += got;
    arrived(come, whole);
  }
  if (std::fflush(file.get()) != 0 || ::fsync(::fileno(file.get())) != 0) return unwritten(part);
  if (::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, out.c_str(), RENAME_NOREPLACE) == 0) return {};
  if (errno != EEXIST) return unwritten(out);
  return tl::unexpected(Refusal{ExitCode::bad_input, out.string() + ": already there; name another file with --out"});
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
