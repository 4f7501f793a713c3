#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>

namespace scanrig {

/// Time for everything in the rig. All waiting goes through a Clock, so that tests can run on a virtual one.
/// Threads: every function may be called from any thread.
class Clock {
 public:
  using Duration = std::chrono::nanoseconds;
  using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;

  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;

  /// Waits, with `lock` held, until `ready()` or `until`; returns `ready()`.
  /// The code that makes `ready()` true must call `notify_all(changed)` of the same clock.
  virtual bool wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& changed, TimePoint until,
                          const std::function<bool()>& ready) = 0;

  virtual void notify_all(std::condition_variable& changed) = 0;

  /// Held by a thread for as long as it runs: a virtual clock moves only while every actor waits in it.
  /// The starter of the thread holds a Busy until the thread has its Actor. No effect on a real clock.
  class Actor {
   public:
    explicit Actor(Clock& clock) : clock_(clock) { clock_.enter(); }
    ~Actor() { clock_.leave(); }
    Actor(const Actor&) = delete;
    Actor& operator=(const Actor&) = delete;

   private:
    Clock& clock_;
  };

  /// Holds a virtual clock still, for work that must cost no time. May pass to another thread.
  class Busy {
   public:
    explicit Busy(Clock& clock) : clock_(clock) { clock_.hold(); }
    ~Busy() { clock_.release(); }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;

   private:
    Clock& clock_;
  };

  /// Sleeps; for devices' physics, never to wait for a result of another thread.
  void sleep_until(TimePoint until);
  void sleep_for(Duration duration) { sleep_until(now() + duration); }

 private:
  virtual void enter() {}
  virtual void leave() {}
  virtual void hold() {}
  virtual void release() {}
};

class RealClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override;
  bool wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& changed, TimePoint until,
                  const std::function<bool()>& ready) override;
  void notify_all(std::condition_variable& changed) override { changed.notify_all(); }
};

/// The moment by which something must have happened.
struct Deadline {
  Clock::TimePoint at;

  static Deadline after(const Clock& clock, Clock::Duration duration) { return {clock.now() + duration}; }
  [[nodiscard]] bool expired(const Clock& clock) const { return clock.now() >= at; }
  [[nodiscard]] Clock::Duration left(const Clock& clock) const {
    const auto now = clock.now();
    return now >= at ? Clock::Duration::zero() : at - now;
  }
  /// The earlier of this deadline and `duration` from now.
  [[nodiscard]] Deadline at_most(const Clock& clock, Clock::Duration duration) const {
    const auto then = clock.now() + duration;
    return {then < at ? then : at};
  }
};

}  // namespace scanrig
