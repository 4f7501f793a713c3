#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "core/clock.h"
#include "daemon/rig/devices.h"
#include "daemon/runtime/actor.h"

namespace scanrig::fakes {

/// Keeps one call of one device from returning until it is released, whatever its deadline.
class Gate {
 public:
  explicit Gate(Clock& clock) : clock_(clock) {}

  /// The next call of this name, "camera.collect", hangs.
  void close(const std::string& call) {
    const std::lock_guard guard(mutex_);
    closed_ = call;
  }
  void release() {
    {
      const std::lock_guard guard(mutex_);
      closed_.clear();
      deadline_.reset();
      ++released_;
    }
    clock_.notify_all(changed_);
  }
  /// The deadline of the call that hangs; nothing: no call does.
  std::optional<Deadline> deadline() const {
    const std::lock_guard guard(mutex_);
    return deadline_;
  }
  [[nodiscard]] bool hangs(const std::string& call) const {
    const std::lock_guard guard(mutex_);
    return deadline_ && closed_ == call;
  }
  [[nodiscard]] bool is_closed(const std::string& call) const {
    const std::lock_guard guard(mutex_);
    return closed_ == call && !deadline_;
  }
  void pass(const std::string& call, Deadline deadline) {
    std::unique_lock lock(mutex_);
    if (closed_ != call || deadline_) return;
    deadline_ = deadline;
    const auto before = released_;
    clock_.wait_until(lock, changed_, Clock::TimePoint::max(), [&] { return released_ != before; });
  }

 private:
  Clock& clock_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::string closed_;
  std::optional<Deadline> deadline_;
  int released_ = 0;
};

/// A driver's thread that hangs obeys no stop either, and its motor continues its last command.
class HangingTurntable final : public Turntable {
 public:
  HangingTurntable(Turntable& turntable, Gate& gate, Clock& clock)
      : turntable_(turntable), gate_(gate), clock_(clock) {}

  Result<void> home(Deadline deadline) override {
    gate_.pass("turntable.home", deadline);
    return turntable_.home(deadline);
  }
  Result<Move> rotate_to(Degrees target, Deadline deadline) override {
    if (!gate_.is_closed("turntable.rotate_to")) return turntable_.rotate_to(target, deadline);
    Ended ended;
    auto motion = start_actor(clock_, [&] {
      std::ignore = turntable_.rotate_to(target, Deadline::after(clock_, std::chrono::hours(1)));
      ended.tell(clock_);
    });
    gate_.pass("turntable.rotate_to", deadline);
    ended.wait(clock_);  // by the clock: it stands still while an actor waits for a join
    motion.join();
    return fail(ErrorCode::timeout, "turntable: hung");
  }
  Result<void> stop(Deadline deadline) override {
    gate_.pass("turntable.stop", deadline);
    return turntable_.stop(deadline);
  }
  Result<void> reset_alarm(Deadline deadline) override {
    gate_.pass("turntable.reset_alarm", deadline);
    return turntable_.reset_alarm(deadline);
  }
  Result<TurntableStatus> status(Deadline deadline) override {
    gate_.pass("turntable.status", deadline);
    return turntable_.status(deadline);
  }
  Result<void> limit_speed(std::optional<DegreesPerSecond> limit) override {
    gate_.pass("turntable.limit_speed", Deadline::after(clock_, std::chrono::seconds(1)));
    return turntable_.limit_speed(limit);
  }
  void request_stop() noexcept override {
    if (!gate_.hangs("turntable.rotate_to")) turntable_.request_stop();
  }
  void drop_stop_request() noexcept override { turntable_.drop_stop_request(); }

 private:
  struct Ended {
    void tell(Clock& clock) {
      {
        const std::lock_guard guard(mutex);
        ended = true;
      }
      clock.notify_all(changed);
    }
    void wait(Clock& clock) {
      std::unique_lock lock(mutex);
      clock.wait_until(lock, changed, Clock::TimePoint::max(), [this] { return ended; });
    }
    std::mutex mutex;
    std::condition_variable changed;
    bool ended = false;
  };

  Turntable& turntable_;
  Gate& gate_;
  Clock& clock_;
};

class HangingProjector final : public Projector {
 public:
  HangingProjector(Projector& projector, Gate& gate) : projector_(projector), gate_(gate) {}
  Result<void> fire(Light light, Deadline deadline) override {
    gate_.pass("projector.fire", deadline);
    return projector_.fire(light, deadline);
  }
  Result<void> turn_off(Deadline deadline) override {
    gate_.pass("projector.turn_off", deadline);
    return projector_.turn_off(deadline);
  }
  void request_off() noexcept override { projector_.request_off(); }

 private:
  Projector& projector_;
  Gate& gate_;
};

class HangingCamera final : public StereoCamera {
 public:
  HangingCamera(StereoCamera& camera, Gate& gate) : camera_(camera), gate_(gate) {}
  Result<void> prepare(Deadline deadline) override {
    gate_.pass("camera.prepare", deadline);
    return camera_.prepare(deadline);
  }
  Result<void> arm(Deadline deadline) override {
    gate_.pass("camera.arm", deadline);
    return camera_.arm(deadline);
  }
  Result<StereoFrame> collect(Deadline deadline) override {
    gate_.pass("camera.collect", deadline);
    return camera_.collect(deadline);
  }
  Result<StereoFrame> capture_preview(Deadline deadline) override {
    gate_.pass("camera.capture_preview", deadline);
    return camera_.capture_preview(deadline);
  }

 private:
  StereoCamera& camera_;
  Gate& gate_;
};

class HangingPanel final : public Panel {
 public:
  HangingPanel(Panel& panel, Gate& gate) : panel_(panel), gate_(gate) {}
  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override {
    gate_.pass("panel.wait_change", deadline);
    return panel_.wait_change(known, deadline);
  }
  Result<void> show(const PanelOutputs& outputs, Deadline deadline) override {
    gate_.pass("panel.show", deadline);
    return panel_.show(outputs, deadline);
  }

 private:
  Panel& panel_;
  Gate& gate_;
};

}  // namespace scanrig::fakes
