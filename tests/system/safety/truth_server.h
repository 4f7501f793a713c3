#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

namespace scanrig {

/// Control socket of a wire simulator, as far as a camera uses it: lines of JSON, every request gets the same reply.
class TruthServer {
 public:
  TruthServer(const std::filesystem::path& path, std::function<std::string()> truth) : truth_(std::move(truth)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.native().size());
    listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  }
  ~TruthServer() {
    thread_ = {};
    ::close(listener_);
  }
  [[nodiscard]] std::string last_question() const { return last_question_; }

 private:
  void serve(const std::stop_token& stop) {
    int client = -1;
    while (!stop.stop_requested()) {
      pollfd watched{client < 0 ? listener_ : client, POLLIN, 0};
      if (::poll(&watched, 1, 20) <= 0) continue;
      if (client < 0) {
        client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
        continue;
      }
      std::array<char, 256> bytes;
      const auto count = ::recv(client, bytes.data(), bytes.size(), 0);
      if (count <= 0) {
        ::close(client);
        client = -1;
        continue;
      }
      if (last_question_.empty()) last_question_.assign(bytes.data(), static_cast<std::size_t>(count));
      const std::string answer = truth_() + "\n";
      std::ignore = ::send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
    }
    if (client >= 0) ::close(client);
  }

  std::function<std::string()> truth_;
  std::string last_question_;  // set by the thread, read once it has ended or no more requests come
  int listener_ = -1;
  std::jthread thread_;
};

}  // namespace scanrig
