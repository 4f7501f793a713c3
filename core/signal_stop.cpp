#include "core/signal_stop.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <utility>

namespace scanrig {
namespace {

/// Signals blocked in this thread, and in those it starts.
int catch_signals(bool hangup) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  if (hangup) sigaddset(&signals, SIGHUP);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
}

}  // namespace

SignalStop::SignalStop(Hangup hangup)
    : caught_(catch_signals(hangup == Hangup::is_told)), end_(::eventfd(0, EFD_CLOEXEC)) {
  thread_ = std::thread([this] { run(); });
}

void SignalStop::run() {
  pollfd watched[] = {{caught_, POLLIN, 0}, {end_, POLLIN, 0}};
  for (;;) {
    if (::poll(watched, 2, -1) < 0) continue;
    if (watched[1].revents != 0) return;
    signalfd_siginfo info{};
    if (::read(caught_, &info, sizeof info) != sizeof info) continue;
    if (info.ssi_signo != SIGHUP) {
      source_.request_stop();
      continue;
    }
    const std::lock_guard guard(mutex_);
    if (hangup_) hangup_();
  }
}

void SignalStop::on_hangup(std::function<void()> what) {
  const std::lock_guard guard(mutex_);
  hangup_ = std::move(what);
}

SignalStop::~SignalStop() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(end_, &one, sizeof one);
  thread_.join();
  ::close(end_);
  ::close(caught_);
}

}  // namespace scanrig
