#include "daemon/service/systemd.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <systemd/sd-bus.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <fmt/format.h>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <string_view>
#include <utility>

namespace scanrig {
namespace {

using std::chrono::microseconds;
using SteadyClock = std::chrono::steady_clock;

unsigned long long monotonic_us() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<unsigned long long>(now.tv_sec) * 1'000'000 + static_cast<unsigned long long>(now.tv_nsec) / 1000;
}

struct CloseBus {
  void operator()(sd_bus* bus) const { ::sd_bus_close_unref(bus); }
};
struct Unref {
  void operator()(sd_bus_message* message) const { ::sd_bus_message_unref(message); }
};
using Bus = std::unique_ptr<sd_bus, CloseBus>;
using Message = std::unique_ptr<sd_bus_message, Unref>;

std::uint64_t us_until(SteadyClock::time_point by) {
  const auto left = std::chrono::duration_cast<microseconds>(by - SteadyClock::now()).count();
  return left > 1 ? static_cast<std::uint64_t>(left) : 1;
}

/// sd_bus_call() alone would wait for a bus that does not greet for as long as the library likes.
int open_bus(Bus& bus, SteadyClock::time_point by) {
  sd_bus* opened = nullptr;
  if (const int failed = ::sd_bus_open_system(&opened); failed < 0) return failed;
  bus.reset(opened);
  for (;;) {
    if (const int ready = ::sd_bus_is_ready(opened); ready != 0) return ready;
    if (SteadyClock::now() >= by) return -ETIMEDOUT;
    const int processed = ::sd_bus_process(opened, nullptr);
    if (processed < 0) return processed;
    if (processed > 0) continue;
    if (const int waited = ::sd_bus_wait(opened, us_until(by)); waited < 0 && waited != -EINTR) return waited;
  }
}

/// The descriptor that is the lock, or a negative error number.
int inhibit(const SleepInhibitorOptions& options, std::string& detail) {
  const auto by = SteadyClock::now() + options.reply_timeout;
  Bus bus;
  if (const int failed = open_bus(bus, by); failed < 0) return failed;
  sd_bus_message* made = nullptr;
  int failed = ::sd_bus_message_new_method_call(bus.get(), &made, "org.freedesktop.login1", "/org/freedesktop/login1",
                                                "org.freedesktop.login1.Manager", "Inhibit");
  if (failed < 0) return failed;
  const Message call(made);
  failed = ::sd_bus_message_append(made, "ssss", "sleep:idle", options.who.c_str(), options.why.c_str(), "block");
  if (failed < 0) return failed;
  sd_bus_error error = SD_BUS_ERROR_NULL;
  sd_bus_message* answered = nullptr;
  failed = ::sd_bus_call(bus.get(), made, us_until(by), &error, &answered);
  const Message reply(answered);
  if (error.message) detail = error.message;
  ::sd_bus_error_free(&error);
  if (failed < 0) return failed;
  int lock = -1;
  if (failed = ::sd_bus_message_read(answered, "h", &lock); failed < 0) return failed;
  const int own = ::fcntl(lock, F_DUPFD_CLOEXEC, 3);  // the message's own is closed with it
  return own < 0 ? -errno : own;
}

}  // namespace

ServiceManager::~ServiceManager() {
  if (ever_ready_) ::sd_notify(0, "STOPPING=1");
}

void ServiceManager::alive(const std::string& sentence) {
  const std::lock_guard guard(mutex_);
  std::string words = "WATCHDOG=1";
  if (state_ == State::starting) words += "\nREADY=1";
  if (state_ != State::reloading && (state_ == State::starting || sentence != told_)) {
    words += "\nSTATUS=" + sentence;
    told_ = sentence;
  }
  if (state_ == State::starting) state_ = State::ready;
  ever_ready_ = true;
  ::sd_notify(0, words.c_str());
}

void ServiceManager::reloading() {
  const std::lock_guard guard(mutex_);
  state_ = State::reloading;
  ::sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%llu\nSTATUS=The configuration is reloaded.", monotonic_us());
}

void ServiceManager::stays(const std::string& sentence) {
  const std::lock_guard guard(mutex_);
  state_ = State::ready;
  ::sd_notify(0, ("READY=1\nSTATUS=" + sentence).c_str());
}

void ServiceManager::begins_again() {
  const std::lock_guard guard(mutex_);
  state_ = State::starting;
  ::sd_notify(0, "WATCHDOG=1");
}

PassedSockets take_passed_sockets() {
  PassedSockets passed;
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    const int fd = SD_LISTEN_FDS_START + i;
    const bool ours = names && std::string_view(names[i]) == "api";
    if (ours && !passed.local && ::sd_is_socket(fd, AF_UNIX, SOCK_STREAM, 1) > 0) {
      passed.local = fd;
    } else if (ours && !passed.tcp && ::sd_is_socket_inet(fd, AF_UNSPEC, SOCK_STREAM, 1, 0) > 0) {
      passed.tcp = fd;
    } else {
      ::close(fd);
    }
  }
  for (int i = 0; i < count && names; ++i) ::free(names[i]);
  ::free(names);
  return passed;
}

SleepInhibitor::SleepInhibitor(std::function<void(const std::string&)> report, SleepInhibitorOptions options)
    : report_(std::move(report)),
      options_(std::move(options)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

SleepInhibitor::~SleepInhibitor() {
  thread_.request_stop();
  thread_.join();
  release();
}

void SleepInhibitor::keep_awake(bool on) {
  const std::scoped_lock lock(mutex_);
  if (is_wanted_ == on) return;
  is_wanted_ = on;
  changed_.notify_all();
}

bool SleepInhibitor::is_settled() const {
  const std::scoped_lock lock(mutex_);
  return is_applied_ == is_wanted_;
}

void SleepInhibitor::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return is_wanted_ != is_applied_; })) {
    const bool on = is_wanted_;
    lock.unlock();
    on ? take() : release();
    lock.lock();
    is_applied_ = on;
  }
}

void SleepInhibitor::take() {
  std::string detail;
  const int lock = inhibit(options_, detail);
  if (lock >= 0) {
    lock_ = lock;
    return;
  }
  if (std::exchange(is_reported_, true)) return;
  report_(fmt::format("Sleep is not blocked during jobs: logind: {}. Disable suspend on this machine.",
                      detail.empty() ? std::strerror(-lock) : detail));
}

void SleepInhibitor::release() {
  if (lock_ >= 0) ::close(std::exchange(lock_, -1));
}

}  // namespace scanrig
