#include "daemon/jobs/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <tuple>
#include <utility>

#include "core/priority.h"

namespace scanrig {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr int kLookEvery = 100;  ///< milliseconds: the longest delay until a stop is noticed
constexpr int kNotStarted = 127;

/// The lines of one output of the child.
class Lines {
 public:
  explicit Lines(int fd) : fd_(fd) { ::fcntl(fd_, F_SETFL, O_NONBLOCK); }
  ~Lines() { ::close(fd_); }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  [[nodiscard]] int fd() const { return open_ ? fd_ : -1; }
  /// Reads the available data; `take` gets every whole line.
  void read(const std::function<void(std::string_view)>& take) {
    char buffer[4096];
    ssize_t got = 0;
    while ((got = ::read(fd_, buffer, sizeof buffer)) > 0) text_.append(buffer, static_cast<std::size_t>(got));
    if (got == 0) open_ = false;
    for (auto end = text_.find('\n'); end != std::string::npos; end = text_.find('\n')) {
      take(std::string_view(text_).substr(0, end));
      text_.erase(0, end + 1);
    }
  }

 private:
  int fd_;
  bool open_ = true;
  std::string text_;
};

void set_limit(int resource, rlim_t value) {
  const rlimit limit{value, value};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

/// A reconstruction is what the kernel ends first when memory runs out, before all else on this machine: it can be
/// repeated. Raising the value needs no capability.
void give_up_first() {
  constexpr std::string_view kScore = "500";
  const int file = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  std::ignore = ::write(file, kScore.data(), kScore.size());
  ::close(file);
}

/// Runs in the child, between fork and exec: only what is safe in a process that had threads.
[[noreturn]] void become(char* const* words, int out, int error, const ChildCommand& command, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::setpgid(0, 0);
  if (::getppid() != parent) ::_exit(kNotStarted);  // the parent died before this was set
  const int nothing = ::open("/dev/null", O_RDONLY);
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(error, STDERR_FILENO);
  ::close_range(3, ~0U, 0);
  lower_priority();
  give_up_first();
  if (command.memory_bytes) set_limit(RLIMIT_DATA, *command.memory_bytes);
  set_limit(RLIMIT_CORE, 0);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::execv(words[0], words);
  ::_exit(kNotStarted);
}

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) == 0) std::tie(read, write) = std::pair(ends[0], ends[1]);
  }
};

}  // namespace

Result<ChildEnd> run_child(const ChildCommand& command, const std::stop_token& stop) {
  std::vector<char*> words;
  for (const auto& word : command.words) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const Pipe out_pipe, error_pipe;
  if (out_pipe.read < 0 || error_pipe.read < 0) {
    return fail(ErrorCode::io, "cannot start {}: {}", command.words[0], std::strerror(errno));
  }
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) become(words.data(), out_pipe.write, error_pipe.write, command, parent);
  ::close(out_pipe.write);
  ::close(error_pipe.write);
  Lines out(out_pipe.read), error(error_pipe.read);
  if (child < 0) return fail(ErrorCode::io, "cannot start {}: {}", command.words[0], std::strerror(errno));

  ChildEnd end;
  const auto give_up = SteadyClock::now() + command.limit;
  const auto hear = [&] {
    out.read(command.on_line);
    error.read([&](std::string_view line) { end.last_words = line; });
  };
  int status = 0;
  bool stopped = false, late = false;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    stopped = stop.stop_requested();
    late = SteadyClock::now() > give_up;
    if (stopped || late) {
      ::kill(-child, SIGKILL);  // and what it started
      ::kill(child, SIGKILL);   // before it has a group of its own
      ::waitpid(child, &status, 0);
      break;
    }
    pollfd outputs[] = {{out.fd(), POLLIN, 0}, {error.fd(), POLLIN, 0}};
    ::poll(outputs, 2, kLookEvery);
    hear();
  }
  hear();
  if (stopped) return fail(ErrorCode::stopped, "stopped by request");
  if (late) {
    return fail(ErrorCode::timeout, "{} did not end within {} s and was killed", command.words[0],
                command.limit.count());
  }
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (end.code == kNotStarted) return fail(ErrorCode::io, "cannot start {}", command.words[0]);
  return end;
}

}  // namespace scanrig
