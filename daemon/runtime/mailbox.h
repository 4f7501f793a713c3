#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
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

}  // namespace scanrig
