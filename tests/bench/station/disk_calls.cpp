// LD_PRELOAD: watches every call that changes files below $DISK_CALLS_ROOT.
//   $DISK_CALLS_KILL=N, $DISK_CALLS_WHEN=before|after   SIGKILL at the N-th of them, counted from 1
//   $DISK_CALLS_FAIL=N, $DISK_CALLS_ERROR=ERRNO           from the N-th on all calls but removals fail with it,
//   $DISK_CALLS_FAILURES=COUNT                          at most this many of them; all if not set
//   $DISK_CALLS_LOG=FILE                                the calls, one line each; data as hexadecimal digits
//   $DISK_CALLS_ACKS=FILE                               writes to this file are logged too, as acknowledgements
// A log line: KIND, PATH, OTHER (second path, offset, size or flags), DATA; separated by tabs. Calls that fail are left
// out.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

struct Settings {
  std::string root = environment("DISK_CALLS_ROOT");
  std::string acks = environment("DISK_CALLS_ACKS");
  long kill_at = std::atol(environment("DISK_CALLS_KILL").c_str());
  long fail_from = std::atol(environment("DISK_CALLS_FAIL").c_str());
  long failures = std::atol(environment("DISK_CALLS_FAILURES").c_str());
  int error = std::atoi(environment("DISK_CALLS_ERROR").c_str());
  bool before = environment("DISK_CALLS_WHEN") == "before";
  int log = -1;
  Settings() {
    const auto file = environment("DISK_CALLS_LOG");
    if (!file.empty()) {
      log = static_cast<int>(
          ::syscall(SYS_openat, AT_FDCWD, file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    }
  }
};

const Settings& settings() {
  static const Settings all;
  return all;
}

/// True once the program has started. A sanitizer's runtime makes the folder of its reports before it can serve calls
/// for memory and guards.
bool is_up = false;
[[gnu::constructor]] void come_up() { is_up = true; }

std::atomic<long> count{0};
std::mutex in_order;  // the log has the order in which the calls happened

template <class Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

std::string path_of(int fd) {
  char link[64], path[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t size = ::readlink(link, path, sizeof path);
  return size > 0 ? std::string(path, static_cast<std::size_t>(size)) : std::string();
}

std::string absolute(int folder, const char* path) {
  if (path[0] == '/') return path;
  if (folder != AT_FDCWD) return path_of(folder) + "/" + path;
  char here[4096];
  return (::getcwd(here, sizeof here) ? std::string(here) : std::string()) + "/" + path;
}

bool watched(const std::string& path) {
  const auto& root = settings().root;
  return !root.empty() && path.starts_with(root) && (path.size() == root.size() || path[root.size()] == '/');
}

void log_line(const char* kind, const std::string& path, const std::string& other, const void* data, std::size_t size) {
  std::string line = std::string(kind) + "\t" + path + "\t" + other + "\t";
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) {
    constexpr const char* kDigits = "0123456789abcdef";
    line += kDigits[bytes[i] >> 4];
    line += kDigits[bytes[i] & 15];
  }
  line += "\n";
  ::syscall(SYS_write, settings().log, line.data(), line.size());
}

/// Makes `call`, counted, failed or killed, and logged as configured.
template <class Call>
auto change(const char* kind, const std::string& path, const std::string& other, const Call& call,
            const void* data = nullptr, std::size_t size = 0) {
  if (!watched(path)) return call();
  const auto& s = settings();
  const long mine = ++count;
  const bool fails = s.fail_from > 0 && mine >= s.fail_from && (s.failures == 0 || mine < s.fail_from + s.failures);
  if (fails && std::strcmp(kind, "remove") != 0) {
    errno = s.error;
    return static_cast<decltype(call())>(-1);
  }
  if (mine == s.kill_at && s.before) ::kill(::getpid(), SIGKILL);
  std::unique_lock<std::mutex> lock(in_order, std::defer_lock);
  if (s.log >= 0) lock.lock();
  const auto result = call();
  const int error = errno;
  if (mine == s.kill_at) ::kill(::getpid(), SIGKILL);
  if (s.log >= 0 && result >= 0) log_line(kind, path, other, data, size);
  errno = error;
  return result;
}

template <class Call>
ssize_t write_call(int fd, off_t at, const void* data, std::size_t size, const Call& call) {
  const int error = errno;
  const auto path = path_of(fd);
  if (at < 0 && watched(path)) at = ::lseek(fd, 0, SEEK_CUR);
  if (settings().log >= 0 && !path.empty() && path == settings().acks) {
    const std::lock_guard<std::mutex> lock(in_order);
    log_line("ack", path, "0", data, size);
  }
  errno = error;
  return change("write", path, std::to_string(at), call, data, size);
}

int open_call(int folder, const char* path, int flags, mode_t mode) {
  const auto call = [&] { return static_cast<int>(::syscall(SYS_openat, folder, path, flags, mode)); };
  const bool changes = (flags & (O_CREAT | O_TRUNC)) != 0 && (flags & O_ACCMODE) != O_RDONLY;
  if (!changes) return call();
  return change((flags & O_TRUNC) != 0 ? "truncate" : "create", absolute(folder, path), "0", call);
}

mode_t mode_of(int flags, va_list& rest) { return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0; }

}  // namespace

extern "C" {

#define OPEN_BODY(FOLDER)                   \
  va_list rest;                             \
  va_start(rest, flags);                    \
  const mode_t mode = mode_of(flags, rest); \
  va_end(rest);                             \
  return open_call(FOLDER, path, flags, mode)

int open(const char* path, int flags, ...) { OPEN_BODY(AT_FDCWD); }
int open64(const char* path, int flags, ...) { OPEN_BODY(AT_FDCWD); }
int openat(int folder, const char* path, int flags, ...) { OPEN_BODY(folder); }
int openat64(int folder, const char* path, int flags, ...) { OPEN_BODY(folder); }

ssize_t write(int fd, const void* data, size_t size) {
  return write_call(fd, -1, data, size, [&] { return static_cast<ssize_t>(::syscall(SYS_write, fd, data, size)); });
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  return write_call(fd, at, data, size,
                    [&] { return static_cast<ssize_t>(::syscall(SYS_pwrite64, fd, data, size, at)); });
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) { return pwrite(fd, data, size, at); }

int fsync(int fd) {
  return change("sync", path_of(fd), "", [&] { return static_cast<int>(::syscall(SYS_fsync, fd)); });
}
int fdatasync(int fd) {
  return change("sync", path_of(fd), "", [&] { return static_cast<int>(::syscall(SYS_fdatasync, fd)); });
}
int ftruncate(int fd, off_t size) noexcept {
  return change("resize", path_of(fd), std::to_string(size),
                [&] { return static_cast<int>(::syscall(SYS_ftruncate, fd, size)); });
}
int ftruncate64(int fd, off64_t size) noexcept { return ftruncate(fd, size); }

int rename(const char* from, const char* to) noexcept {
  return change("rename", absolute(AT_FDCWD, from), absolute(AT_FDCWD, to),
                [&] { return static_cast<int>(::syscall(SYS_rename, from, to)); });
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  return change((flags & 2U) != 0 ? "exchange" : "rename", absolute(from_folder, from), absolute(to_folder, to),
                [&] { return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags)); });
}
int mkdir(const char* path, mode_t mode) noexcept {
  const auto call = [&] { return static_cast<int>(::syscall(SYS_mkdir, path, mode)); };
  return is_up ? change("mkdir", absolute(AT_FDCWD, path), "", call) : call();
}
int unlinkat(int folder, const char* path, int flags) noexcept {
  return change("remove", absolute(folder, path), "",
                [&] { return static_cast<int>(::syscall(SYS_unlinkat, folder, path, flags)); });
}
int unlink(const char* path) noexcept { return unlinkat(AT_FDCWD, path, 0); }
int rmdir(const char* path) noexcept { return unlinkat(AT_FDCWD, path, AT_REMOVEDIR); }
int remove(const char* path) noexcept {
  const int removed = unlink(path);
  return removed != 0 && errno == EISDIR ? rmdir(path) : removed;
}

}  // extern "C"
