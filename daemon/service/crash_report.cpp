#include "daemon/service/crash_report.h"

#include <execinfo.h>
#include <fcntl.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string_view>
#include <vector>

#include "core/version.h"

namespace scanrig {
namespace {

constexpr std::size_t kKept = 5;
constexpr std::array kSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr int kFrames = 64;
constexpr unsigned kLimitSeconds = 2;  ///< a crash within the allocator may leave the back-trace waiting for a lock

std::array<char, 512> folder_and_slash{};
alignas(16) std::array<char, 64 * 1024> signal_stack;
std::atomic_flag is_reporting = ATOMIC_FLAG_INIT;

void put(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(file, text.data(), text.size());
    if (count <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
}

/// A text buffer that grows without the allocator.
struct Text {
  std::array<char, 768> bytes{};
  std::size_t size = 0;

  void add(std::string_view more) {
    const std::size_t fits = std::min(more.size(), bytes.size() - 1 - size);
    std::memcpy(bytes.data() + size, more.data(), fits);
    size += fits;
  }
  void add(long number) {
    const auto end = std::to_chars(bytes.data() + size, bytes.data() + bytes.size() - 1, number);
    if (end.ec == std::errc()) size = static_cast<std::size_t>(end.ptr - bytes.data());
  }
  [[nodiscard]] std::string_view view() const { return {bytes.data(), size}; }
};

std::string_view name_of(int number) {
  switch (number) {
    case SIGSEGV: return "SIGSEGV";
    case SIGBUS: return "SIGBUS";
    case SIGFPE: return "SIGFPE";
    case SIGILL: return "SIGILL";
    case SIGABRT: return "SIGABRT";
    default: return "signal";
  }
}

void write_report(int number) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  Text path;
  path.add(std::string_view(folder_and_slash.data()));
  path.add(static_cast<long>(now.tv_sec));
  path.add("-");
  path.add(static_cast<long>(::getpid()));
  path.add(".txt");
  const int file = ::open(path.bytes.data(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (file < 0) return;
  std::array<char, 17> thread{};
  ::prctl(PR_GET_NAME, thread.data());
  Text head;
  for (const std::string_view part : {std::string_view("version "), std::string_view(kVersion), std::string_view(", "),
                                      name_of(number), std::string_view(", thread "), std::string_view(thread.data())})
    head.add(part);
  head.add(", Unix time ");
  head.add(static_cast<long>(now.tv_sec));
  head.add("\n");
  put(file, head.view());
  std::array<void*, kFrames> frames{};
  ::backtrace_symbols_fd(frames.data(), ::backtrace(frames.data(), kFrames), file);
  ::close(file);
}

void handle(int number) {
  if (is_reporting.test_and_set()) {
    for (;;) ::pause();  // another thread crashed first and ends the process
  }
  ::signal(SIGALRM, SIG_DFL);
  ::alarm(kLimitSeconds);
  write_report(number);
  ::alarm(0);
  ::signal(number, SIG_DFL);
  ::raise(number);  // pending until this handler returns
}

void keep_newest(const std::filesystem::path& folder, std::size_t count) {
  std::error_code ignored;
  std::vector<std::filesystem::path> reports;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".txt") reports.push_back(entry.path());
  }
  std::ranges::sort(reports);  // by time: the names start with ten digits
  while (reports.size() > count) {
    std::filesystem::remove(reports.front(), ignored);
    reports.erase(reports.begin());
  }
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kHasOwnReports = true;
#else
constexpr bool kHasOwnReports = false;
#endif

}  // namespace

std::filesystem::path crash_folder(const std::filesystem::path& storage_root) {
  const char* const state = std::getenv("STATE_DIRECTORY");  // several are separated by colons
  const std::string_view first = state ? std::string_view(state).substr(0, std::string_view(state).find(':')) : "";
  return (first.empty() ? storage_root / ".state" : std::filesystem::path(first)) / "crash";
}

void report_crashes_to(const std::filesystem::path& folder) {
  const std::string prefix = folder.string() + "/";
  if (kHasOwnReports || prefix.size() >= folder_and_slash.size()) return;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return;
  keep_newest(folder, kKept - 1);  // room for the next one
  std::ranges::copy(prefix, folder_and_slash.begin());
  folder_and_slash[prefix.size()] = '\0';
  void* frame = nullptr;
  ::backtrace(&frame, 1);  // loads its library now, not in a process that has crashed
  const stack_t stack{.ss_sp = signal_stack.data(), .ss_flags = 0, .ss_size = signal_stack.size()};
  ::sigaltstack(&stack, nullptr);
  struct sigaction action {};
  action.sa_handler = handle;
  action.sa_flags = SA_ONSTACK;
  for (const int number : kSignals) ::sigaction(number, &action, nullptr);
}

}  // namespace scanrig
