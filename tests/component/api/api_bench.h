#pragma once

#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>

#include "daemon/api/access.h"
#include "daemon/api/server.h"
#include "daemon/api/socket_file.h"
#include "tests/unit/daemon/api/station_without_rig.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig::api_bench {

struct Answer {
  int status = 0;  ///< 0: hung up without a reply
  std::string head, body;
  [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
};

/// A client that sends exactly the given bytes. Reading gives up after 5 s.
class Wire {
 public:
  explicit Wire(int fd) : fd_(fd) { wait_at_most(std::chrono::seconds(5)); }
  ~Wire() {
    if (fd_ >= 0) ::close(fd_);
  }
  Wire(Wire&& other) noexcept : fd_(std::exchange(other.fd_, -1)), read_(std::move(other.read_)) {}
  Wire& operator=(Wire&&) = delete;

  /// Of each reading, instead of 5 s.
  void wait_at_most(std::chrono::seconds reply_timeout) const {
    const timeval limit{.tv_sec = reply_timeout.count(), .tv_usec = 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }

  bool say(const std::string& text) const {
    return ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  /// Reads until `end`; returns everything up to and including it, or everything until the other end hung up.
  std::string hear(const std::string& end) {
    std::size_t found = 0;
    while ((found = read_.find(end)) == std::string::npos && more()) {
    }
    const auto size = found == std::string::npos ? read_.size() : found + end.size();
    auto text = read_.substr(0, size);
    read_.erase(0, size);
    return text;
  }
  /// True when the other end has hung up and nothing is left to be read.
  bool ended() {
    while (more()) {
    }
    return read_.empty() || ended_;
  }
  Answer answer() {
    Answer answer;
    answer.head = hear("\r\n\r\n");
    if (answer.head.size() < 12) return answer;
    answer.status = std::stoi(answer.head.substr(9, 3));
    const auto length = answer.head.find("Content-Length: ");
    const std::size_t size = length == std::string::npos ? 0 : std::stoul(answer.head.substr(length + 16));
    while (read_.size() < size && more()) {
    }
    answer.body = read_.substr(0, size);
    read_.erase(0, answer.body.size());
    return answer;
  }

 private:
  bool more() {
    char room[4096];
    const auto got = ::recv(fd_, room, sizeof room, 0);
    ended_ = got == 0;
    if (got <= 0) return false;
    read_.append(room, static_cast<std::size_t>(got));
    return true;
  }
  int fd_;
  std::string read_;
  bool ended_ = false;
};

/// A server on a socket and on TCP over a station without a rig, with a token for every role.
class ApiBench : public scan_samples::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    std::filesystem::create_directories(folder_ / "jobs/old/model");
    scan_samples::write_text(folder_ / "jobs/old/model/model.glb", "glTF" + std::string(300'000, 'x'));
    scan_samples::write_text(folder_ / "jobs/old/model/report.json", "{}");
    scan_samples::write_text(folder_ / "secret", "do not read");
    TokenFile file;
    for (const Role role : kRoles) tokens[role] = *file.add(std::string(to_string(role)), role, "now");
    ASSERT_TRUE(file.write(folder_ / "tokens.json"));
    options.socket = folder_ / "api.sock";
    options.http_port = 0;
    options.tokens = folder_ / "tokens.json";
    options.storage = folder_;
  }
  void serve() {
    const auto wake = [this] {
      if (auto* server = running.load()) server->wake();
    };
    station.emplace(one_job("old", folder_ / "jobs/old"), wake, has_guard);
    auto started = ApiServer::start(options, station->loop);
    ASSERT_TRUE(started) << started.error().message;
    api = std::move(*started);
    running = api.get();
  }
  /// The control loop ends before the server, as in the daemon.
  void TearDown() override {
    const std::unique_ptr<ApiServer> last = std::move(api);
    if (station) station->end();
    FolderTest::TearDown();
  }

  Wire local() const { return Wire(connect_to_socket(options.socket).value_or(-1)); }
  /// A client at 127.0.0.`host`.
  Wire tcp(std::uint32_t host = 1) const {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + host);
    EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&here), sizeof here), 0);
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(static_cast<std::uint16_t>(api->http_port()));
    there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&there), sizeof there), 0);
    return Wire(fd);
  }
  static std::string request(const std::string& method, const std::string& target, const std::string& token = "",
                             const std::string& body = "", const std::string& more = "") {
    return method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" +
           (token.empty() ? "" : "Authorization: Bearer " + token + "\r\n") + more +
           (body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n") + "\r\n" + body;
  }
  Answer ask(Wire wire, const std::string& text) const {
    EXPECT_TRUE(wire.say(text));
    return wire.answer();
  }

  bool has_guard = true;
  std::map<Role, std::string> tokens;
  ApiOptions options;
  std::optional<StationWithoutRig> station;
  std::unique_ptr<ApiServer> api;
  std::atomic<ApiServer*> running = nullptr;
};

}  // namespace scanrig::api_bench
