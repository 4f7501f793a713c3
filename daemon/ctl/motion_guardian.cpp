#include "daemon/ctl/motion_guardian.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <utility>

#include "daemon/rig/make_safe.h"

namespace scanrig::ctl {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kStartTimeout{5};
constexpr seconds kLifeTimeout{2};       ///< a program in a move without reports for this long is killed
constexpr seconds kMakeSafeTimeout{60};  ///< for a drive whose cable or power is gone
constexpr seconds kResultTimeout = kMakeSafeTimeout + seconds(5);
constexpr seconds kExitTimeout{2};
constexpr const char* kName = "motion-guardian";  ///< 15 bytes: what killall and ps compare

// Bytes from the program that moves the rig, and from the guardian.
constexpr char kMoving = 'm';
constexpr char kIdle = 'i';
constexpr char kDismissed = 'd';
constexpr char kReady = 'r';
constexpr char kStopped = 's';
constexpr char kNotStopped = 'x';

bool send_byte(int socket, char byte) {
  return ::send(socket, &byte, 1, MSG_NOSIGNAL | MSG_DONTWAIT) == 1 || errno == EAGAIN;
}

/// The next byte; nothing at the end of the stream. Fails with `timeout`.
Result<std::optional<char>> receive_byte(int socket, std::optional<Clock::Duration> timeout) {
  pollfd watched{socket, POLLIN, 0};
  const int wait = timeout ? static_cast<int>(std::chrono::ceil<milliseconds>(*timeout).count()) : -1;
  int ready = 0;
  while ((ready = ::poll(&watched, 1, wait)) < 0 && errno == EINTR) {
  }
  if (ready == 0) return fail(ErrorCode::timeout, "motion guardian: no message in time");
  char byte = 0;
  if (::recv(socket, &byte, 1, 0) != 1) return std::optional<char>{};
  return std::optional(byte);
}

/// Blocked from its first instruction on: it ends when the program it guards has ended.
sigset_t signals_of_guardian() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) sigaddset(&signals, number);
  return signals;
}

Result<pid_t> spawn_guardian(const std::filesystem::path& config, int socket) {
  std::string name = kName, verb = "guard-motion", path = std::filesystem::absolute(config).string();
  std::array<char*, 4> argv{name.data(), verb.data(), path.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&files, socket, STDIN_FILENO);
  ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  const sigset_t blocked = signals_of_guardian();
  ::posix_spawnattr_setsigmask(&attributes, &blocked);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
  pid_t child = -1;
  const int error = ::posix_spawn(&child, "/proc/self/exe", &files, &attributes, argv.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  if (error != 0) return fail(ErrorCode::io, "motion guardian: cannot be started: {}", std::strerror(error));
  return child;
}

/// Handles the end of the program, or its silence in a move.
enum class End { dismissed, gone, hangs };

End wait_for_end(int socket) {
  for (bool is_moving = false;;) {
    const auto byte = receive_byte(socket, is_moving ? std::optional<Clock::Duration>(kLifeTimeout) : std::nullopt);
    if (!byte) return End::hangs;
    if (!*byte) return End::gone;
    if (**byte == kDismissed) return End::dismissed;
    is_moving = **byte == kMoving;
  }
}

void print_error(const std::string& message) { fmt::print(stderr, "scanrig: {}\n", message); }

}  // namespace

Result<MotionGuardian> MotionGuardian::start(const std::filesystem::path& config, Clock& clock) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return fail(ErrorCode::io, "motion guardian: cannot be started: {}", std::strerror(errno));
  }
  const auto child = spawn_guardian(config, ends[1]);
  ::close(ends[1]);
  if (!child) {
    ::close(ends[0]);
    return pass_on(child);
  }
  MotionGuardian guardian(ends[0], *child);
  const auto by = Deadline::after(clock, kStartTimeout);
  const auto byte = receive_byte(guardian.socket_, by.left(clock));
  if (byte && *byte == kReady) return guardian;
  ::kill(*child, SIGKILL);  // nothing has moved yet
  guardian.wait_for_exit();
  return fail(ErrorCode::timeout, "motion guardian: did not start; nothing was moved");
}

MotionGuardian::MotionGuardian(MotionGuardian&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), child_(std::exchange(other.child_, -1)) {}

MotionGuardian::~MotionGuardian() {
  if (socket_ >= 0) ::close(socket_);
}

bool MotionGuardian::report(bool is_moving) { return send_byte(socket_, is_moving ? kMoving : kIdle); }

void MotionGuardian::dismiss() {
  send_byte(socket_, kDismissed);
  wait_for_exit();
}

Result<void> MotionGuardian::take_over() {
  ::shutdown(socket_, SHUT_WR);
  const auto byte = receive_byte(socket_, kResultTimeout);
  wait_for_exit();
  if (byte && *byte == kStopped) return {};
  return fail(ErrorCode::timeout,
              "turntable: standstill not confirmed in {} s, it may be moving. Keep clear. Check the drive's power and "
              "cable",
              kMakeSafeTimeout.count());
}

/// The end of the stream is the end of the process; one that does not end is left alone.
void MotionGuardian::wait_for_exit() {
  auto byte = receive_byte(socket_, kExitTimeout);
  if (byte && *byte) byte = receive_byte(socket_, kExitTimeout);
  ::close(std::exchange(socket_, -1));
  if (byte) ::waitpid(child_, nullptr, 0);
}

ExitCode guard_motion(const std::filesystem::path& config) {
  ::prctl(PR_SET_NAME, kName);
  std::signal(SIGPIPE, SIG_IGN);  // the receiver of the messages may be gone
  const pid_t parent = ::getppid();
  const auto base = config.parent_path();
  const auto read = [&](config::SafetyDevice device) { return config::read_device_config(device, config, base); };
  const DeviceConfigs devices{read(config::SafetyDevice::turntable), read(config::SafetyDevice::projector),
                              read(config::SafetyDevice::panel)};
  if (!devices.turntable) {
    print_error(devices.turntable.error().message);
    return exit_code(devices.turntable.error().code);
  }
  if (!send_byte(STDIN_FILENO, kReady)) return ExitCode::internal;
  const End end = wait_for_end(STDIN_FILENO);
  if (end == End::dismissed) return ExitCode::ok;
  if (end == End::hangs && ::getppid() == parent) {
    print_error("the program that moves the table does not run any more: it is ended and the table stopped");
    ::kill(parent, SIGKILL);  // frees the drive's port
  }
  RealClock clock;
  const auto made = make_safe(devices, clock, Deadline::after(clock, kMakeSafeTimeout));
  send_byte(STDIN_FILENO, made.turntable ? kStopped : kNotStopped);
  for (const auto* result : {&made.turntable, &made.projector, &made.panel}) {
    if (!*result) print_error(result->error().message);
  }
  if (!made.turntable) return ExitCode::device;
  return made.projector && made.panel ? ExitCode::ok : ExitCode::partly_safe;
}

}  // namespace scanrig::ctl
