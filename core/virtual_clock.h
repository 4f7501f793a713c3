#pragma once

#include <cstddef>
#include <list>
#include <set>
#include <thread>

#include "core/clock.h"

namespace scanrig {

/// A clock for tests: it jumps to the earliest moment in its waiters' list as soon as every actor waits in it. A
/// notified waiter counts as running until it has checked its condition again, so no time-out overtakes a wake-up.
/// Threads without an Actor may wait too. They never keep the clock from moving, except while they check again. An
/// actor that blocks on anything but this clock stops time for all threads.
class VirtualClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override;
  bool wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& changed, TimePoint until,
                  const std::function<bool()>& ready) override;
  void notify_all(std::condition_variable& changed) override;

 private:
  struct Waiter {
    const std::condition_variable* changed;  ///< only its address is used: the variable that the waiter waits on
    TimePoint until;
    bool actor;
    bool woken = false;
    std::condition_variable wake{};
  };

  void enter() override;
  void leave() override;
  void hold() override;
  void release() override;

  void wake(Waiter& waiter);
  void move_if_idle();

  // Lock order: a waiter's own mutex, then this one.
  mutable std::mutex mutex_;
  TimePoint now_{};
  std::set<std::thread::id> actors_;
  std::list<Waiter*> waiters_;      ///< asleep, not yet woken
  std::size_t waiting_actors_ = 0;  ///< actors among `waiters_`
  std::size_t looking_again_ = 0;   ///< woken, `ready()` not yet evaluated
  std::size_t holds_ = 0;
};

}  // namespace scanrig
