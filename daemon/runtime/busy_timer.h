#pragma once

#include <atomic>
#include <limits>

#include "core/clock.h"

namespace scanrig {

/// How long a thread has been at what it does now: for what nobody can tell to stop.
/// Threads: one works, any may ask.
class BusyTimer {
 public:
  explicit BusyTimer(const Clock& clock) : clock_(clock) {}

  /// It begins, or has got on with what it does.
  void begins() { since_ = clock_.now().time_since_epoch().count(); }
  void ends() { since_ = kIdle; }
  /// Zero where it does nothing.
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
