// What the daemon tells systemd, heard on the socket that systemd would listen to.
#include "daemon/service_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "core/virtual_clock.h"
#include "daemon/station/control_loop.h"

namespace scanrig {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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

  /// What has been said, in order; one message each.
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

TEST(ServiceManager, IsToldOnceThatTheServiceIsReadyAndEveryTimeThatItLives) {
  Listener systemd;
  ServiceManager manager;
  manager.alive("Press Reset.");
  manager.alive("Press Reset.");
  const auto heard = systemd.heard();
  ASSERT_EQ(heard.size(), 2u);
  EXPECT_EQ(heard[0], "WATCHDOG=1\nREADY=1\nSTATUS=Press Reset.");
  EXPECT_EQ(heard[1], "WATCHDOG=1");
}

TEST(ServiceManager, IsToldWhatTheServiceDoesWhenThatChanges) {
  Listener systemd;
  ServiceManager manager;
  manager.alive("Press Reset.");
  manager.alive("The table is homing.");
  EXPECT_THAT(systemd.heard().back(), HasSubstr("STATUS=The table is homing."));
}

TEST(ServiceManager, IsToldThatTheServiceEndsOnlyIfItEverBegan) {
  Listener systemd;
  { ServiceManager never; }
  EXPECT_TRUE(systemd.heard().empty());
  {
    ServiceManager manager;
    manager.alive("");
  }
  EXPECT_EQ(systemd.heard().back(), "STOPPING=1");
}

TEST(ServiceManager, AnIdleControlLoopSaysEverySecondThatItLives) {
  VirtualClock clock;
  ControlLoop loop(clock, {}, {});
  int signs = 0;
  const Clock::Actor actor(clock);
  const auto begin = clock.now();
  const StationPorts ports{.alive =
                               [&] {
                                 if (++signs == 60) loop.post(event::Shutdown{});
                               },
                           .perform = [](const Action&) {},
                           .show = [](const PanelOutputs&) {},
                           .fresh_job_id = [] { return std::string(); }};
  std::ignore = loop.run(ports);
  EXPECT_LE(clock.now() - begin, std::chrono::seconds(60 + 5));  // 5 s to be seen stopped
}

}  // namespace
}  // namespace scanrig
