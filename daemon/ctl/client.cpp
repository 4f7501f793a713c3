#include "daemon/ctl/client.h"

#include <sys/socket.h>
#include <sys/time.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <nlohmann/json.hpp>

#include "daemon/api/socket_file.h"

namespace scanrig::ctl {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;
using Answer = tl::expected<nlohmann::json, Refusal>;
using Response = http::response<http::string_body>;

constexpr timeval kPatience{.tv_sec = 15, .tv_usec = 0};

tl::unexpected<Refusal> unreachable(std::string message) {
  return tl::unexpected(Refusal{ExitCode::unreachable, std::move(message)});
}

/// What the API says is wrong.
tl::unexpected<Refusal> refusal(const Response& response, const nlohmann::json& json, const std::string& target) {
  if (!json.is_object() || !json.contains("error") || !json["error"].is_object()) {
    return unreachable(fmt::format("{}: an answer that is not the API's (HTTP {})", target, response.result_int()));
  }
  const auto code = parse_error_code(json["error"].value("code", ""));
  return tl::unexpected(Refusal{exit_code(code.value_or(ErrorCode::internal)), json["error"].value("message", "")});
}

tl::expected<Response, Refusal> exchange(const std::filesystem::path& path, const std::string& method,
                                         const std::string& target) {
  const auto connected = connect_to_socket(path);
  if (!connected) return unreachable(connected.error().message + "; is the daemon running?");
  ::setsockopt(*connected, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  ::setsockopt(*connected, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  net::io_context io;
  net::local::stream_protocol::socket socket(io, net::local::stream_protocol(), *connected);

  http::request<http::empty_body> request(http::string_to_verb(method), target, 11);
  request.set(http::field::host, "localhost");
  request.keep_alive(false);
  Response response;
  boost::beast::flat_buffer buffer;
  boost::system::error_code error;
  http::write(socket, request, error);
  if (!error) http::read(socket, buffer, response, error);
  if (error) return unreachable(fmt::format("{}: the daemon does not answer: {}", path.string(), error.message()));
  return response;
}

}  // namespace

Answer ask(const std::filesystem::path& socket, const std::string& method, const std::string& target) {
  const auto response = exchange(socket, method, target);
  if (!response) return tl::unexpected(response.error());
  auto json = nlohmann::json::parse(response->body(), nullptr, false);
  if (response->result() == http::status::ok && json.is_object()) return json;
  return refusal(*response, json, target);
}

tl::expected<std::string, Refusal> fetch(const std::filesystem::path& socket, const std::string& target) {
  const auto response = exchange(socket, "GET", target);
  if (!response) return tl::unexpected(response.error());
  if (response->result() == http::status::ok) return response->body();
  return refusal(*response, nlohmann::json::parse(response->body(), nullptr, false), target);
}

}  // namespace scanrig::ctl
