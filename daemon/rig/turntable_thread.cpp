#include "daemon/rig/turntable_thread.h"

#include <utility>

#include "daemon/runtime/actor.h"

namespace scanrig {
namespace {

constexpr auto kStopLimit = std::chrono::seconds(1);

}  // namespace

TurntableThread::TurntableThread(Turntable& turntable, Clock& clock)
    : turntable_(turntable), clock_(clock), thread_(start_actor(clock, [this] { run(); })) {}

TurntableThread::~TurntableThread() {
  {
    const std::lock_guard guard(mutex_);
    end_ = true;
  }
  clock_.notify_all(changed_);
  thread_.join();
}

template <class Answer>
Answer TurntableThread::ask(const std::function<Answer()>& what) {
  std::optional<Answer> answer;
  std::unique_lock lock(mutex_);
  task_ = [&] { answer = what(); };
  clock_.notify_all(changed_);
  // The task keeps its own deadline.
  clock_.wait_until(lock, changed_, Clock::TimePoint::max(), [this] { return !task_; });
  return std::move(*answer);
}

void TurntableThread::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    clock_.wait_until(lock, changed_, Clock::TimePoint::max(), [this] { return task_ || stop_wanted_ || end_; });
    if (std::exchange(stop_wanted_, false)) {
      const auto direct = std::exchange(direct_stop_, std::nullopt);
      lock.unlock();
      // No reply: the station requests evidence through stop(), and the driver has a stop pending from now on.
      const auto stopped = turntable_.stop(Deadline::after(clock_, direct ? direct->limit : kStopLimit));
      if (direct) direct->done(stopped);
      lock.lock();
    } else if (task_) {
      lock.unlock();
      task_();  // no thread changes it while it is set
      lock.lock();
      task_ = nullptr;
      clock_.notify_all(changed_);
    } else if (end_) {
      return;
    }
  }
}

Result<void> TurntableThread::home(Deadline deadline) {
  return ask<Result<void>>([&] { return turntable_.home(deadline); });
}
Result<Move> TurntableThread::rotate_to(Degrees target, Deadline deadline) {
  return ask<Result<Move>>([&] { return turntable_.rotate_to(target, deadline); });
}
Result<void> TurntableThread::stop(Deadline deadline) {
  return ask<Result<void>>([&] { return turntable_.stop(deadline); });
}
Result<void> TurntableThread::reset_alarm(Deadline deadline) {
  return ask<Result<void>>([&] { return turntable_.reset_alarm(deadline); });
}
Result<TurntableStatus> TurntableThread::status(Deadline deadline) {
  return ask<Result<TurntableStatus>>([&] { return turntable_.status(deadline); });
}
Result<void> TurntableThread::limit_speed(std::optional<DegreesPerSecond> limit) {
  return ask<Result<void>>([&] { return turntable_.limit_speed(limit); });
}

void TurntableThread::stop_directly(Clock::Duration limit, std::function<void(const Result<void>&)> done) {
  turntable_.request_stop();
  {
    const std::lock_guard guard(mutex_);
    stop_wanted_ = true;
    direct_stop_ = DirectStop{limit, std::move(done)};
  }
  clock_.notify_all(changed_);
}

void TurntableThread::request_stop() noexcept {
  turntable_.request_stop();
  {
    const std::lock_guard guard(mutex_);
    stop_wanted_ = true;
  }
  clock_.notify_all(changed_);
}

OutsideStop::~OutsideStop() {
  if (thread_.joinable()) thread_.join();
}

void OutsideStop::begin() {
  {
    const std::lock_guard guard(mutex_);
    if (std::exchange(is_under_way_, true)) return;
  }
  if (thread_.joinable()) thread_.join();  // it has reported already
  thread_ = start_actor(clock_, [this] { run(); });
}

void OutsideStop::run() {
  const auto stopped = stop_();
  {
    const std::lock_guard guard(mutex_);
    is_under_way_ = false;
  }
  if (!stopped) return report_(event::StopFailed{stopped.error()});
  // The projector's own thread turns it off by its stop, which waits behind the turntable.
  report_(event::Stopped{Error{ErrorCode::timeout, "projector: not confirmed dark, the turntable hangs"}});
}

}  // namespace scanrig
