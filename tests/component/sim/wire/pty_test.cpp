#include "sim/wire/pty.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include "tests/own_folder.h"

namespace scanrig::sim::wire {
namespace {

bool hangs_up(int port) {
  pollfd watched{port, POLLIN, 0};
  return ::poll(&watched, 1, 1000) == 1 && (watched.revents & POLLHUP) != 0;
}

TEST(PtyTest, ALineHangsUpAlthoughProgramsWereStartedWhileItOpened) {
  const auto link = own_folder("line_");
  std::atomic<bool> is_over = false;
  std::vector<pid_t> programs;
  std::thread starter([&] {
    while (!is_over && programs.size() < 300) {
      pid_t child = -1;
      std::string name = "sleep", time = "100";
      char* argv[] = {name.data(), time.data(), nullptr};
      if (::posix_spawn(&child, "/bin/sleep", nullptr, nullptr, argv, environ) == 0) programs.push_back(child);
    }
  });
  int kept_open = 0;
  for (int i = 0; i < 2000 && kept_open == 0; ++i) {
    int port = -1;
    {
      const auto line = Pty::open(link);
      ASSERT_TRUE(line) << line.error().message;
      port = ::open(link.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
      ASSERT_GE(port, 0);
    }
    if (!hangs_up(port)) ++kept_open;
    ::close(port);
  }
  is_over = true;
  starter.join();
  for (const pid_t child : programs) ::kill(child, SIGKILL);
  for (const pid_t child : programs) ::waitpid(child, nullptr, 0);
  EXPECT_EQ(kept_open, 0);
}

}  // namespace
}  // namespace scanrig::sim::wire
