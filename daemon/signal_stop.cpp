#include "daemon/signal_stop.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>

namespace scanrig {

SignalStop::SignalStop() : end_(::eventfd(0, EFD_CLOEXEC)) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  const int caught = ::signalfd(-1, &signals, SFD_CLOEXEC);
  thread_ = std::thread([this, caught] {
    pollfd watched[] = {{caught, POLLIN, 0}, {end_, POLLIN, 0}};
    while (::poll(watched, 2, -1) < 0) {
    }
    if (watched[0].revents != 0) source_.request_stop();
    ::close(caught);
  });
}

SignalStop::~SignalStop() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(end_, &one, sizeof one);
  thread_.join();
  ::close(end_);
}

}  // namespace scanrig
