#include "config/setup/asking_program.h"

#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <tuple>

namespace scanrig::config::setup {
namespace {

using SteadyClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kReadEvery{100};
constexpr std::size_t kReadAtOnce = 4096;

struct Connection {
  ConnectionEnd mine, its;
  Connection() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return;
    mine = ConnectionEnd(ends[0]);
    its = ConnectionEnd(ends[1]);
  }
};

void take(ConnectionEnd& end, std::string& text, const std::function<void(const std::string&)>& on_line) {
  std::array<char, kReadAtOnce> buffer{};
  for (;;) {
    if (end.fd() < 0) return;
    const auto got = ::recv(end.fd(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) end.close();
    if (got <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(got));
  }
  for (auto newline = text.find('\n'); newline != std::string::npos; newline = text.find('\n')) {
    on_line(text.substr(0, newline));
    text.erase(0, newline + 1);
  }
}

}  // namespace

void ConnectionEnd::close() {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

Result<AskingProgram> AskingProgram::start(std::vector<std::string> words) {
  AskingProgram program;
  Connection in, out, error;
  if (error.its.fd() < 0) return fail(ErrorCode::io, "setup: cannot start: {}", std::strerror(errno));
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_t actions;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_init(&actions);
  sigset_t none;
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&attributes, &none);  // a service blocks the signals it waits for
  ::posix_spawnattr_setpgroup(&attributes, 0);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  ::posix_spawn_file_actions_adddup2(&actions, in.its.fd(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, out.its.fd(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, error.its.fd(), STDERR_FILENO);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  const int refused = ::posix_spawn(&program.pid_, arguments[0], &actions, &attributes, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::posix_spawnattr_destroy(&attributes);
  if (refused != 0) return fail(ErrorCode::io, "setup: cannot start {}: {}", words[0], std::strerror(refused));
  program.in_ = std::move(in.mine);
  program.out_ = std::move(out.mine);
  program.error_ = std::move(error.mine);
  return program;
}

void AskingProgram::write(const std::string& line) const {
  std::ignore = ::send(in_.fd(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

bool AskingProgram::read(const std::function<void(const std::string&)>& on_line) {
  std::array<pollfd, 2> outputs{{{out_.fd(), POLLIN, 0}, {error_.fd(), POLLIN, 0}}};
  ::poll(outputs.data(), outputs.size(), static_cast<int>(kReadEvery.count()));
  take(out_, out_text_, on_line);
  take(error_, error_text_, [this](const std::string& line) { last_words_ = line; });
  if (out_.fd() >= 0 || error_.fd() >= 0) return true;
  return ::waitpid(pid_, &status_, WNOHANG) == 0;
}

void AskingProgram::end(milliseconds grace) {
  in_.close();
  const auto limit = SteadyClock::now() + grace;
  while (SteadyClock::now() < limit) {
    if (!read([](const auto&) {})) return;
  }
  ::kill(-pid_, SIGKILL);
  ::waitpid(pid_, &status_, 0);
}

int AskingProgram::code() const { return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1; }

}  // namespace scanrig::config::setup
