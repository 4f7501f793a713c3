#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <latch>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/clock.h"

namespace scanrig {

/// The only data that threads of the daemon share: messages in order, from any thread to one.
template <class Message>
class Mailbox {
 public:
  explicit Mailbox(Clock& clock) : clock_(clock) {}

  /// Adds a message, from any thread. After close() the message is dropped.
  void post(Message message) {
    {
      const std::lock_guard guard(mutex_);
      if (closed_) return;
      messages_.push_back(std::move(message));
    }
    clock_.notify_all(changed_);
  }

  /// The next message; nothing when `until` passes, or when the box is closed and empty.
  std::optional<Message> take(Clock::TimePoint until = Clock::TimePoint::max()) {
    std::unique_lock lock(mutex_);
    clock_.wait_until(lock, changed_, until, [this] { return closed_ || !messages_.empty(); });
    if (messages_.empty()) return std::nullopt;
    std::optional<Message> message(std::move(messages_.front()));
    messages_.pop_front();
    return message;
  }

  /// Still delivers what was posted; accepts nothing more.
  void close() {
    {
      const std::lock_guard guard(mutex_);
      closed_ = true;
    }
    clock_.notify_all(changed_);
  }

 private:
  Clock& clock_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> messages_;
  bool closed_ = false;
};

/// Starts a thread that is an actor of `clock` for as long as it runs, and already when this returns.
inline std::thread start_actor(Clock& clock, std::function<void()> run) {
  auto entered = std::make_shared<std::latch>(1);
  std::thread thread([&clock, entered, run = std::move(run)] {
    const Clock::Actor actor(clock);
    entered->count_down();
    run();
  });
  entered->wait();
  return thread;
}

/// Measures how long a thread has been at its present work: for work that cannot be stopped.
/// Threads: one works, any may read.
class BusyTimer {
 public:
  explicit BusyTimer(const Clock& clock) : clock_(clock) {}

  /// Marks the start of work, or progress in it.
  void begins() { since_ = clock_.now().time_since_epoch().count(); }
  void ends() { since_ = kIdle; }
  /// Zero without work.
  [[nodiscard]] Clock::Duration lasts() const {
    const auto since = since_.load();
    return since == kIdle ? Clock::Duration::zero() : clock_.now().time_since_epoch() - Clock::Duration(since);
  }

 private:
  static constexpr auto kIdle = std::numeric_limits<Clock::Duration::rep>::max();

  const Clock& clock_;
  std::atomic<Clock::Duration::rep> since_ = kIdle;
};

}  // namespace scanrig
