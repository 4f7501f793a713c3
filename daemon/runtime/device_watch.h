#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "core/clock.h"
#include "core/result.h"

namespace scanrig {

/// A call of a device's driver that has not returned by its deadline.
struct HungCall {
  std::string device;      ///< as DeviceHealth names it
  std::string call;        ///< as the device's interface names it
  Clock::Duration late{};  ///< since its deadline
};

/// The same as a message for people; `timeout`.
inline Error hung_error(const HungCall& call) {
  return {
      ErrorCode::timeout,
      fmt::format("{}: {} has not returned {:.1f} s after its deadline; check its cable, the service restarts itself",
                  call.device, call.call, std::chrono::duration<double>(call.late).count())};
}

/// Records which call of a device's driver is under way and by when it must return. The thread that waits for it
/// cannot report the hang itself.
/// Threads: one makes the calls, any may read.
class DeviceWatch {
 public:
  /// A call that is this late hangs. With the control loop's polling period it is named within a second.
  static constexpr Clock::Duration kMargin = std::chrono::milliseconds(700);

  /// `device`: as DeviceHealth names it; outlives this.
  DeviceWatch(const Clock& clock, const char* device, Clock::Duration margin = kMargin)
      : clock_(clock), device_(device), margin_(margin) {}

  /// Lasts for as long as this lives, or until end().
  class Call {
   public:
    Call(DeviceWatch& watch, const char* name, Deadline deadline) : watch_(watch) { watch_.begin({name, deadline}); }
    ~Call() { end(); }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    /// How late it is, where another thread may have seen it hang.
    std::optional<HungCall> end() { return watch_.end(); }

   private:
    DeviceWatch& watch_;
  };

  [[nodiscard]] std::optional<HungCall> hung() const {
    const std::lock_guard guard(mutex_);
    return hung_now();
  }

 private:
  struct Made {
    const char* name;
    Deadline deadline;
  };
  void begin(const Made& made) {
    const std::lock_guard guard(mutex_);
    made_ = made;
  }
  std::optional<HungCall> end() {
    const std::lock_guard guard(mutex_);
    auto call = hung_now();
    made_.reset();
    return call;
  }
  [[nodiscard]] std::optional<HungCall> hung_now() const {
    if (!made_) return std::nullopt;
    const auto late = clock_.now() - made_->deadline.at;
    if (late < margin_) return std::nullopt;
    return HungCall{device_, made_->name, late};
  }

  const Clock& clock_;
  const char* const device_;
  const Clock::Duration margin_;
  mutable std::mutex mutex_;
  std::optional<Made> made_;  // guarded by mutex_
};

}  // namespace scanrig
