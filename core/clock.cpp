#include "core/clock.h"

namespace scanrig {

void Clock::sleep_until(TimePoint until) {
  std::mutex mutex;
  std::condition_variable unused;
  std::unique_lock lock(mutex);
  wait_until(lock, unused, until, [] { return false; });
}

Clock::TimePoint RealClock::now() const { return std::chrono::steady_clock::now(); }

bool RealClock::wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& changed, TimePoint until,
                           const std::function<bool()>& ready) {
  return changed.wait_until(lock, until, ready);
}

}  // namespace scanrig
