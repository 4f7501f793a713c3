#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/clock.h"
#include "daemon/rig/devices.h"

namespace scanrig::fakes {

/// Devices that keep to their interfaces and record their calls; nothing is rendered.
/// The test's thread is the operator: it reads the lamps and presses buttons.

class FakeTurntable final : public Turntable {
 public:
  explicit FakeTurntable(Clock& clock) : clock_(clock) {}

  Result<void> home(Deadline deadline) override {
    const auto turned = turn_to(0.0, deadline);
    const std::lock_guard guard(mutex);
    homed_ = turned.has_value();
    return turned ? Result<void>{} : pass_on(turned);
  }
  Result<Move> rotate_to(Degrees target, Deadline deadline) override {
    {
      const std::lock_guard guard(mutex);
      if (!homed_) return fail(ErrorCode::not_homed, "turntable: not homed");
    }
    auto turned = turn_to(target.value, deadline);
    if (turned) return turned;
    const std::lock_guard guard(mutex);
    homed_ = false;
    return turned;
  }
  Result<void> stop(Deadline) override {
    const std::lock_guard guard(mutex);
    ++stops;
    last_stop = clock_.now();
    if (unreachable) return fail(ErrorCode::timeout, "turntable: no reply");
    moving = false;
    return {};
  }
  Result<void> reset_alarm(Deadline) override { return {}; }
  Result<TurntableStatus> status(Deadline) override {
    const std::lock_guard guard(mutex);
    return TurntableStatus{reported, homed_, std::nullopt, alarm};
  }
  Result<void> limit_speed(std::optional<DegreesPerSecond> limit) override {
    const std::lock_guard guard(mutex);
    speed_ = std::min(45.0, limit.value_or(DegreesPerSecond{45.0}).value);
    return {};
  }
  void request_stop() noexcept override {
    {
      const std::lock_guard guard(mutex);
      stop_requested_ = true;
    }
    clock_.notify_all(changed_);
  }
  void drop_stop_request() noexcept override {
    const std::lock_guard guard(mutex);
    stop_requested_ = false;
  }

  std::mutex mutex;  ///< guards all that follows
  bool moving = false;
  bool stalled = false;
  bool unreachable = false;
  int stops = 0;  ///< calls of stop()
  Clock::TimePoint last_stop{};
  TurntableStatus::Motion reported = TurntableStatus::Motion::stopped;  ///< by status()
  std::string alarm;                                                    ///< likewise
  std::vector<double> targets;                                          ///< of every move, homing included
  std::vector<Clock::TimePoint> move_starts;                            ///< of the same

 private:
  /// 45 degrees a second; a stop ends it, and an earlier stop does too.
  Result<Move> turn_to(double target, Deadline deadline) {
    std::unique_lock lock(mutex);
    const auto start = clock_.now();
    if (std::exchange(stop_requested_, false)) return fail(ErrorCode::stopped, "turntable: stopped on request");
    targets.push_back(target);
    move_starts.push_back(start);
    moving = true;
    const auto way = std::chrono::duration<double>(std::abs(target - angle_) / speed_);
    const auto arrival = start + std::chrono::duration_cast<Clock::Duration>(way) + std::chrono::milliseconds(1);
    const auto until =
        stalled ? std::min(deadline.at, start + std::chrono::seconds(2)) : std::min(deadline.at, arrival);
    const bool stop = clock_.wait_until(lock, changed_, until, [this] { return stop_requested_; });
    moving = false;
    if (stop) {
      stop_requested_ = false;
      return fail(ErrorCode::stopped, "turntable: stopped on request");
    }
    if (stalled) return fail(ErrorCode::stalled, "turntable: no progress for 2 s");
    if (until < arrival) return fail(ErrorCode::timeout, "turntable: not in position in time");
    angle_ = target;
    return Move{{target}, {target + 0.01}, arrival - start, std::chrono::milliseconds(200)};
  }

  Clock& clock_;
  std::condition_variable changed_;
  double speed_ = 45.0;
  double angle_ = 200.0;
  bool homed_ = false;
  bool stop_requested_ = false;
};

/// Projector and cameras share the trigger line.
struct TriggerLine {
  std::mutex mutex;
  bool lit = false;
  bool armed = false;
  int exposures = 0;  ///< since the start
  int lose = 0;       ///< the next exposures whose frames never arrive
  int looks = 0;      ///< since the start
  int looks_before_exposures = 0;
  int looks_in_between = 0;  ///< between the first exposure and the latest
  int dark = 0;              ///< the next exposures whose right image is dark
  bool projector_absent = false;
  int absent = 0;                 ///< further failures of the camera when it is armed; -1: it is missing
  std::function<void()> at_fire;  ///< called during the next exposure, or
  int fires_before = 0;           ///< after this many more
  Clock::TimePoint ready_at{};    ///< time of the last request to prepare the cameras
  Clock::Duration ready_takes{};  ///< time they need for that
  Light last = Light::plain;
  int scene = 0;                  ///< the cameras' scene: another number, another image
  cv::Mat picture;                ///< the plain image, instead of a grey one; empty: none
  std::vector<double> factors;    ///< of the cameras' exposures since the start
  double factor = 1.0;            ///< of the next exposures
  int light = 200;                ///< grey value of the pattern in an exposure of the usual duration
  bool has_one_exposure = false;  ///< the cameras refuse another one
};

class FakeProjector final : public Projector {
 public:
  explicit FakeProjector(TriggerLine& line) : line_(line) {}
  Result<void> fire(Light light, Deadline) override {
    dark_requested_ = false;
    std::function<void()> happens;
    {
      const std::lock_guard guard(line_.mutex);
      if (line_.exposures++ == 0) line_.looks_before_exposures = line_.looks;
      line_.looks_in_between = line_.looks - line_.looks_before_exposures;
      line_.last = light;
      line_.lit = false;  // the pulse is over when this returns
      if (line_.fires_before > 0) {
        --line_.fires_before;
      } else {
        happens = std::exchange(line_.at_fire, nullptr);
      }
    }
    if (happens) happens();
    if (dark_requested_) return fail(ErrorCode::io, "projector: went dark on request");
    return {};
  }
  Result<void> turn_off(Deadline) override {
    const std::lock_guard guard(line_.mutex);
    if (line_.projector_absent) return fail(ErrorCode::io, "projector: no answer");
    line_.lit = false;
    return {};
  }
  void request_off() noexcept override { dark_requested_ = true; }

 private:
  TriggerLine& line_;
  std::atomic<bool> dark_requested_ = false;
};

class FakeCamera final : public StereoCamera {
 public:
  FakeCamera(TriggerLine& line, Clock& clock) : line_(line), clock_(clock) {}
  Result<void> prepare(Deadline) override {
    Clock::TimePoint answer;
    {
      const std::lock_guard guard(line_.mutex);
      line_.ready_at = clock_.now();
      answer = line_.ready_at + line_.ready_takes;
    }
    if (answer > clock_.now()) clock_.sleep_until(answer);
    const std::lock_guard guard(line_.mutex);
    return there();
  }
  Result<void> arm(Deadline) override {
    const std::lock_guard guard(line_.mutex);
    auto answers = there();
    if (line_.absent > 0) --line_.absent;
    if (!answers) return answers;
    line_.armed = true;
    return {};
  }
  Result<void> scale_exposure(double factor, Deadline deadline) override {
    const std::lock_guard guard(line_.mutex);
    if (line_.has_one_exposure) return StereoCamera::scale_exposure(factor, deadline);
    line_.factor = factor;
    return {};
  }
  Result<StereoFrame> capture_preview(Deadline) override {
    const std::lock_guard guard(line_.mutex);
    if (auto answers = there(); !answers) return pass_on(answers);
    ++line_.looks;
    StereoFrame frame;
    frame.left = frame.right = line_.picture.empty() ? cv::Mat(48, 64, CV_8UC1, cv::Scalar(30)) : line_.picture;
    return frame;
  }
  Result<StereoFrame> collect(Deadline deadline) override {
    bool lost = false;
    StereoFrame frame;
    {
      const std::lock_guard guard(line_.mutex);
      if (!line_.armed) return fail(ErrorCode::protocol, "camera: not armed");
      line_.armed = false;
      lost = line_.lose > 0;
      if (lost) --line_.lose;
      line_.factors.push_back(line_.factor);
      const bool is_dark = line_.light < 100;  // in both lights
      const int plain = is_dark ? line_.light : 100;
      const cv::Scalar grey(std::min(255.0, line_.factor * (line_.last == Light::pattern ? line_.light : plain)) +
                            line_.scene);
      const bool drawn = line_.last == Light::plain && !line_.picture.empty();
      frame.left = drawn ? line_.picture : cv::Mat(48, 64, CV_8UC1, grey);
      frame.right = drawn ? line_.picture : cv::Mat(48, 64, CV_8UC1, grey);
      frame.taken = clock_.now();
      frame.left_evidence.brightness = frame.right_evidence.brightness = grey[0] / 255;
      if (line_.dark > 0) {
        --line_.dark;
        frame.right_evidence.brightness = 0.0;
      }
    }
    if (lost) {
      clock_.sleep_until(deadline.at);
      return fail(ErrorCode::timeout, "camera: no frame");
    }
    return frame;
  }

 private:
  Result<void> there() const {
    if (line_.absent != 0) return fail(ErrorCode::io, "left camera 4711: no answer");
    return {};
  }

  TriggerLine& line_;
  Clock& clock_;
};

class FakePanel final : public Panel {
 public:
  explicit FakePanel(Clock& clock) : clock_(clock) {}

  Result<PanelInputs> wait_change(const PanelInputs& known, Deadline deadline) override {
    std::unique_lock lock(mutex_);
    clock_.wait_until(lock, changed_, deadline.at, [&] { return broken_ || inputs_ != known; });
    clock_.wait_until(lock, changed_, Clock::TimePoint::max(), [&] { return !hangs_; });
    if (broken_) return fail(ErrorCode::io, "panel: unplugged");
    seen_ = inputs_;
    clock_.notify_all(changed_);
    return inputs_;
  }
  Result<void> show(const PanelOutputs& outputs, Deadline) override {
    {
      const std::lock_guard guard(mutex_);
      outputs_ = outputs;
      attached_ = true;
    }
    attach_.notify_all();
    clock_.notify_all(changed_);
    return {};
  }

  // The operator's side.

  /// Waits until a thread drives the panel, in real time: the clock has no actor yet that keeps it from running away.
  void wait_attached() {
    std::unique_lock lock(mutex_);
    attach_.wait(lock, [&] { return attached_; });
  }

  /// No thread drives it any more.
  void detach() {
    const std::lock_guard guard(mutex_);
    attached_ = false;
    outputs_ = {};
  }

  /// Reads the lamps until `as_wanted`, for a virtual hour at most.
  bool wait_for_lamps(const std::function<bool(const PanelOutputs&)>& as_wanted) {
    std::unique_lock lock(mutex_);
    return clock_.wait_until(lock, changed_, clock_.now() + std::chrono::hours(1), [&] { return as_wanted(outputs_); });
  }
  PanelOutputs lamps() {
    const std::lock_guard guard(mutex_);
    return outputs_;
  }
  /// Presses until the panel's owner has read it, then lets go.
  void press(bool PanelInputs::*button) {
    set(button, true);
    set(button, false);
  }
  void set(bool PanelInputs::*input, bool value) {
    std::unique_lock lock(mutex_);
    inputs_.*input = value;
    clock_.notify_all(changed_);
    clock_.wait_until(lock, changed_, clock_.now() + std::chrono::hours(1), [&] { return seen_ == inputs_; });
  }
  void break_down(bool broken) {
    {
      const std::lock_guard guard(mutex_);
      broken_ = broken;
    }
    clock_.notify_all(changed_);
  }
  /// A reader of it waits, whatever the deadline.
  void hang(bool hangs) {
    {
      const std::lock_guard guard(mutex_);
      hangs_ = hangs;
    }
    clock_.notify_all(changed_);
  }

 private:
  Clock& clock_;
  std::mutex mutex_;
  std::condition_variable changed_;
  PanelInputs inputs_;
  PanelInputs seen_;
  PanelOutputs outputs_;
  bool broken_ = false;
  bool hangs_ = false;
  std::condition_variable attach_;
  bool attached_ = false;
};

struct FakeRig {
  explicit FakeRig(Clock& clock) : turntable(clock), projector(line), camera(line, clock), panel(clock) {}
  Devices devices() { return {turntable, projector, camera, panel}; }
  TriggerLine line;
  FakeTurntable turntable;
  FakeProjector projector;
  FakeCamera camera;
  FakePanel panel;
};

}  // namespace scanrig::fakes
