#include "core/virtual_clock.h"

#include <algorithm>
#include <cassert>

namespace scanrig {

Clock::TimePoint VirtualClock::now() const {
  const std::lock_guard guard(mutex_);
  return now_;
}

bool VirtualClock::wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& changed, TimePoint until,
                              const std::function<bool()>& ready) {
  bool looking_again = false;
  while (true) {
    const bool is_ready = ready();
    std::unique_lock guard(mutex_);
    if (looking_again) --looking_again_;
    if (is_ready || now_ >= until) {
      move_if_idle();
      return is_ready;
    }
    Waiter self{&changed, until, actors_.contains(std::this_thread::get_id())};
    waiters_.push_back(&self);
    if (self.actor) ++waiting_actors_;
    // The caller's lock is released only after this waiter is listed: a later change finds the waiter.
    lock.unlock();
    move_if_idle();
    self.wake.wait(guard, [&] { return self.woken; });
    guard.unlock();
    lock.lock();
    looking_again = true;
  }
}

void VirtualClock::notify_all(std::condition_variable& changed) {
  const std::lock_guard guard(mutex_);
  for (auto next = waiters_.begin(); next != waiters_.end();) {
    Waiter& waiter = **next++;
    if (waiter.changed == &changed) wake(waiter);
  }
}

void VirtualClock::wake(Waiter& waiter) {
  waiters_.remove(&waiter);
  if (waiter.actor) --waiting_actors_;
  ++looking_again_;
  waiter.woken = true;
  waiter.wake.notify_one();
}

void VirtualClock::move_if_idle() {
  if (holds_ > 0 || looking_again_ > 0 || waiting_actors_ < actors_.size() || waiters_.empty()) return;
  const auto earliest = (*std::ranges::min_element(waiters_, {}, [](const Waiter* w) { return w->until; }))->until;
  if (earliest == TimePoint::max()) return;  // every waiter waits for a thread outside
  now_ = std::max(now_, earliest);
  for (auto next = waiters_.begin(); next != waiters_.end();) {
    Waiter& waiter = **next++;
    if (waiter.until <= now_) wake(waiter);
  }
}

void VirtualClock::enter() {
  const std::lock_guard guard(mutex_);
  [[maybe_unused]] const bool first = actors_.insert(std::this_thread::get_id()).second;
  assert(first && "one Actor per thread");
}

void VirtualClock::leave() {
  const std::lock_guard guard(mutex_);
  [[maybe_unused]] const auto left = actors_.erase(std::this_thread::get_id());
  assert(left == 1 && "an Actor is destroyed by the thread that made it");
  move_if_idle();
}

void VirtualClock::hold() {
  const std::lock_guard guard(mutex_);
  ++holds_;
}

void VirtualClock::release() {
  const std::lock_guard guard(mutex_);
  --holds_;
  move_if_idle();
}

}  // namespace scanrig
