#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace scanrig {

/// The far end of NOTIFY_SOCKET.
class Listener {
 public:
  Listener() : file_(std::filesystem::temp_directory_path() / ("scanrig-notify-" + std::to_string(::getpid()))) {
    std::filesystem::remove(file_);
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    file_.string().copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", file_.c_str(), 1);
  }
  ~Listener() {
    ::unsetenv("NOTIFY_SOCKET");
    ::close(socket_);
    std::filesystem::remove(file_);
  }

  /// Messages received, in order.
  std::vector<std::string> heard() {
    std::vector<std::string> messages;
    std::array<char, 4096> text{};
    for (;;) {
      const auto size = ::recv(socket_, text.data(), text.size(), MSG_DONTWAIT);
      if (size < 0) return messages;
      messages.emplace_back(text.data(), static_cast<std::size_t>(size));
    }
  }

 private:
  std::filesystem::path file_;
  int socket_ = -1;
};

}  // namespace scanrig
