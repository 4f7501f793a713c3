#pragma once

#include <atomic>
#include <limits>

#include "core/clock.h"

namespace scanrig {

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
