#pragma once

#include <algorithm>
#include <vector>

#include "core/clock.h"

namespace scanrig::sim {

/// A clock for one thread: waiting moves it. Planned events happen on the way.
class ManualClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }

  bool wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable&, TimePoint until,
                  const std::function<bool()>& ready) override {
    while (!ready()) {
      const auto next =
          std::min_element(events_.begin(), events_.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
      if (next == events_.end() || next->at > until) {
        now_ = std::max(now_, until);
        return ready();
      }
      now_ = std::max(now_, next->at);
      const auto happens = next->happens;
      events_.erase(next);
      lock.unlock();
      happens();
      lock.lock();
    }
    return true;
  }
  void notify_all(std::condition_variable& changed) override { changed.notify_all(); }

  void at(Duration from_now, std::function<void()> happens) {
    events_.push_back({now_ + from_now, std::move(happens)});
  }
  Deadline within(Duration duration) const { return Deadline::after(*this, duration); }

 private:
  struct Event {
    TimePoint at;
    std::function<void()> happens;
  };
  TimePoint now_{std::chrono::hours(1)};
  std::vector<Event> events_;
};

}  // namespace scanrig::sim
